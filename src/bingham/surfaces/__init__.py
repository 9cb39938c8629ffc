"""Surfaces seen by depth cameras: normals, plane directions, planes as unit 4-vectors."""
