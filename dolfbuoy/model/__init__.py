"""What a scene is made of, as unknowns and forms on meshes."""
