"""What `check` says of buoys: mass, draft and metacentre, free and under the pull of their lines, and their rest."""

import math

from ..parallel.ranks import bcast
from ..scene.network import attached_ends


def of_buoys(scene, buoys, report) -> None:
    """Add masses, drafts and metacentric heights to the Report of `check`."""
    for buoy in buoys:
        said, free, lever = report.about(buoy.name), buoy.under(0.0), "restoring lever per weight of the buoy"
        said.add("buoy mass with point masses", buoy.mass.mass, "kg")
        said.add("centre of mass C above keel", buoy.mass.height, "m")
        said.add("draft, free", free.draft, "m")
        said.add("GM, free", free.GM, "m")
        if buoy.drowned:
            said.add("the cable holds the buoy under water: pull", buoy.spare, "N", "all of its spare buoyancy")
            said.warn(
                f"All of the hull is under water, held there with {buoy.spare:.4g} N: its lines are too short or too "
                f"heavy for {scene.sea.depth:.4g} m of water."
            )
            said.add("GM under water", buoy.GM, "m", lever)
        elif buoy.how:
            said.add(f"draft {buoy.how}", buoy.under(buoy.pull).draft, "m")
            said.add(f"GM {buoy.how}", buoy.GM, "m", lever)
        if buoy.GM <= 0:
            heels = "only its lines right it" if buoy.righted else "the upright buoy is unstable and heels over"
            said.warn(f"GM = {buoy.GM:.3g} m is not positive: {heels}.")


def buoys_at_rest(problem, report) -> None:
    """Add where moored buoys rest to the Report of `check`; collective."""
    network = problem.network
    for name, rank in problem.buoy_ranks.items():
        buoy, of = problem.buoys.get(name), f" of {name}" if len(network.buoys) > 1 else ""
        x, y, z = bcast(problem.comm, buoy and buoy.fields.of(problem.system.u[buoy.part.slice]).position, rank)
        ends = [(network.pieces[k], i) for k, i in attached_ends(network)]
        cables = [(piece.cable, i) for piece, i in ends if piece.ends[i].name == name]
        far = [network.pieces[network.first_of(c) if i else network.last_of(c)].ends[1 - i] for c, i in cables]
        if far and all(end.held for end in far):
            middle = [sum(end.top.position[axis] for end in far) / len(far) for axis in (0, 1)]
            what = "the anchor" if len(far) == 1 else "the middle of its anchors"
            report.add(f"equilibrium: offset of C{of} from {what}", math.dist((x, y), middle), "m")
        report.add(f"equilibrium: C{of} above still water", z, "m")
