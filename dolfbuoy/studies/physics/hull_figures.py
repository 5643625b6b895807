"""Figures of study hull: response over the period, and righting levers over the heel."""

import math

import numpy as np

from ...results.style import COLORS, PAGE, legend_below, new_figure
from ...results.tables import groups

COLOR = {"moored": COLORS["blue"], "free": COLORS["red"]}
PANELS = {"surge": "surge [m/m]", "heave": "heave [m/m]", "pitch_over_slope": "pitch / slope of the wave"}


def draw_responses(linear, runs, flow, shortest):
    """Amplitudes and phases of surge, heave and pitch; runs and flow: rows to be marked beside the curves.

    shortest: period below which waves are too short for strips.
    """
    figure = new_figure(PAGE, 4.2)
    panels = figure.subplots(2, 3, sharex=True)
    for (name, title), (top, below) in zip(PANELS.items(), panels.T, strict=True):
        _draw_curves(top, below, name, linear, runs)
        _mark(top, below, name, flow, "flow", COLORS["ink"])
        _scale(top, linear, name, shortest)
        top.set_title(title)
        below.set(xlabel="period [s]", ylim=(-190, 190), yticks=range(-180, 181, 90))
        for axes in (top, below):
            axes.axvspan(0, shortest, color=COLORS["sand"], alpha=0.25, lw=0)
            axes.set(xlim=(2, 20.5), xticks=[2, 5, 10, 15, 20])
    panels[0, 0].set_ylabel("amplitude")
    panels[1, 0].set_ylabel("phase behind the crest [deg]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    one_each = dict(zip(labels, handles, strict=True))
    legend_below(figure, 0.3, 5, sorted(one_each.values(), key=lambda line: line.get_marker() != "None"))
    return figure


def _draw_curves(top, below, name, linear, runs):
    """Amplitude and phase of a motion, moored and free, with the points of the runs."""
    for held, rows in groups(linear, "held").items():
        period = [row["period"] for row in rows]
        top.plot(period, [row[name] for row in rows], color=COLOR[held], label=held)
        below.plot(period, _unbroken([row[f"{_motion(name)}_phase"] for row in rows]), color=COLOR[held])
        _mark(top, below, name, [row for row in runs if row["held"] == held], "run", COLOR[held])


def _mark(top, below, name, rows, source, color):
    """Points of runs or of potential flow, if there are any."""
    if not rows:
        return
    marker, label = {"run": ("o", "runs in time"), "flow": ("+", "potential flow, free")}[source]
    style = {"ls": "", "marker": marker, "color": color, "mfc": "none", "ms": 5, "label": label}
    period = [row["period"] for row in rows]
    top.plot(period, [row[f"{name}_{source}"] for row in rows], **style)
    below.plot(period, [row[f"{_motion(name)}_{source}_phase"] for row in rows], **style)


def _motion(name):
    """Whose phase stands below a panel."""
    return name.split("_")[0]


def _unbroken(phases):
    """Phases [deg] with a gap where they jump, at an undamped peak or from one side to the other."""
    phases = np.array(phases)
    phases[1:][np.abs(np.diff(phases)) > 170] = np.nan
    return phases


def _scale(axes, linear, name, shortest):
    """From 0 to the largest value, but no higher than thrice what is usual: undamped peaks have no height."""
    values = [row[name] for row in linear if row["period"] >= shortest] or [row[name] for row in linear]
    if values:
        axes.set_ylim(0, 1.08 * min(max(values), 3 * float(np.median(values))))


def draw_levers(levers, GM):
    """Righting levers over the heel, with the slope GM at 0; GM: held -> value."""
    figure = new_figure(PAGE / 2, 2.6)
    axes = figure.subplots()
    for held, rows in groups(levers, "held").items():
        heel, lever = ([row[key] for row in rows] for key in ("heel_deg", "lever"))
        axes.plot(heel, lever, color=COLOR[held], label=held)
        axes.plot([0, 20], [0, GM[held] * math.radians(20)], ":", color=COLOR[held], lw=0.8)
    axes.axhline(0, color=COLORS["ink"], lw=0.6)
    axes.set(xlabel="heel [deg]", ylabel="righting lever GZ [m]", xlim=(0, 180), xticks=range(0, 181, 30))
    if levers:
        axes.legend()
    return figure
