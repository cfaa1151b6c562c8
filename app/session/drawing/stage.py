# pyright: reportAttributeAccessIssue=false
"""What never moves: lights, surroundings, floor, and the table with its legs."""

from typing import Literal

import mujoco
import numpy as np
import viser

from app.session.drawing.glb import Material, write_glb
from app.session.drawing.materials import is_visible, model_material, surface
from app.session.drawing.meshes import build_glb, geom_surface, has_texture_coordinates
from app.session.drawing.palette import Theme, rgb
from app.session.drawing.shapes import Surface, box, merge
from app.session.drawing.subject import TABLE, Subject

FLOOR_Z_M = -0.735  # [m] below the table's top
LEG_WIDTH_M = 0.05
LEG_INSET_M = 0.045  # [m] from the table's edge to the leg's outer face

KEY_DIRECTION = (-0.75, 0.75, 1.9)
"""The key light stands behind the robot's left shoulder: shadows fall towards the viewer and tell
how high a thing is."""
FILL_DIRECTION = (0.9, -1.5, 0.9)

Detail = Literal["full", "plain"]
PLAIN_SKY = 1.6
"""Intensity of the hemisphere light where it has to stand in for the environment map."""


class Stage:
    """Everything fixed to the world; rebuilt in place when the theme changes."""

    def __init__(
        self,
        server: viser.ViserServer,
        subject: Subject,
        theme: Theme,
        detail: Detail = "full",
    ):
        self._scene, self._subject, self._detail = server.scene, subject, detail
        self._scene.set_up_direction("+z")
        self._scene.world_axes.visible = False
        self._scene.configure_default_lights(False, False)
        self.set_theme(theme)

    def set_theme(self, theme: Theme) -> None:
        """Put lights, floor and table into a theme's colours."""
        self._lights(theme)
        if self._detail == "full":
            self._floor(theme)
        self._static_bodies(theme)

    def _lights(self, theme: Theme) -> None:
        scene, full = self._scene, self._detail == "full"
        if full:
            scene.configure_environment_map("studio", environment_intensity=theme.environment)
        scene.add_light_directional(
            "/hindsight/light/key",
            color=(255, 246, 234),
            intensity=theme.key,
            cast_shadow=full,
            position=KEY_DIRECTION,
        )
        scene.add_light_directional(
            "/hindsight/light/fill",
            color=(214, 228, 255),
            intensity=theme.fill,
            position=FILL_DIRECTION,
        )
        sky, ground, intensity = theme.hemisphere
        scene.add_light_hemisphere(
            "/hindsight/light/sky",
            sky_color=rgb(sky),
            ground_color=rgb(ground),
            intensity=intensity if full else PLAIN_SKY,
        )

    def _floor(self, theme: Theme) -> None:
        plane, cell, section = theme.floor
        self._scene.add_grid(
            "/hindsight/floor",
            width=12.0,
            height=12.0,
            position=(0.0, 0.0, FLOOR_Z_M),
            cell_size=0.25,
            section_size=1.0,
            plane_opacity=1.0,
            plane_color=rgb(plane),
            cell_color=rgb(cell),
            section_color=rgb(section),
            shadow_opacity=theme.floor_shadow,
            fade_from="origin",
            fade_distance=5.5,
            fade_strength=1.6,
        )

    def _static_bodies(self, theme: Theme) -> None:
        model = self._subject.model
        geoms = [g for g in self._subject.static_geoms if is_visible(model, g)]
        tables = [g for g in geoms if model.geom(g).name == TABLE]
        top = surface(theme.table, theme.table_roughness)
        for table in tables:
            parts: list[tuple[Surface, Material]] = []
            if (shape := geom_surface(model, table)) is not None:
                parts = [(shape, top), (_legs(model, table), surface(theme.legs, 0.6))]
            self._scene.add_glb("/hindsight/table", write_glb(parts))
        rest = build_glb(
            model,
            [g for g in geoms if g not in tables],
            lambda g: model_material(model, g, has_texture_coordinates(model, g)),
        )
        if rest:
            self._scene.add_glb("/hindsight/fixed", rest)


def _legs(model: mujoco.MjModel, table: int) -> Surface:
    """Four legs from the table's underside to the floor, in the world frame."""
    centre, half = model.geom_pos[table], model.geom_size[table]
    under = float(centre[2] - half[2])
    height = under - FLOOR_Z_M
    leg = box([LEG_WIDTH_M / 2, LEG_WIDTH_M / 2, height / 2])
    reach = half[:2] - LEG_INSET_M - LEG_WIDTH_M / 2
    return merge(
        [
            leg.moved(
                [centre[0] + x * reach[0], centre[1] + y * reach[1], under - height / 2], np.eye(3)
            )
            for x in (-1, 1)
            for y in (-1, 1)
        ]
    )
