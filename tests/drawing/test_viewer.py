"""What the view sends for a record, and that it sends nothing else."""

from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import pytest
import viser

from app.core.settings import AssistanceSettings
from app.core.types import Goals
from app.recording.schema import StepRecord
from app.robot.scene import Scene
from app.session.drawing import LayersError, Viewer
from app.session.drawing.palette import DARK, LIGHT, ThemeError, rgb
from app.session.drawing.subject import SubjectError

Find = Callable[[str], Any]


def changed(record: StepRecord, **fields: Any) -> StepRecord:
    """A record with some fields changed."""
    return msgspec.structs.replace(record, **fields)


def queued(server: viser.ViserServer) -> int:
    """Messages put before clients since the server started."""
    return server._websock_server._broadcast_buffer.message_counter


def test_an_unchanged_record_sends_nothing(
    server: viser.ViserServer, viewer: Viewer, records: list[StepRecord], goals: Goals
) -> None:
    """An unchanged record sends nothing."""
    viewer.update(records[0], goals)
    before = queued(server)
    for step in range(1, 6):
        viewer.update(changed(records[0], step=step, time_s=0.01 * step), goals)
    assert queued(server) == before


def test_a_servo_that_trembles_sends_nothing(
    server: viser.ViserServer, viewer: Viewer, records: list[StepRecord], goals: Goals
) -> None:
    """A servo that trembles sends nothing."""
    joints = records[0].joint_positions_rad
    hand = [round(256 * v) / 256 for v in records[0].hand_position_m]
    quiet = changed(records[0], hand_position_m=hand)
    viewer.update(quiet, goals)
    before = queued(server)
    viewer.update(changed(quiet, joint_positions_rad=[q + 1e-9 for q in joints]), goals)
    assert queued(server) == before


def test_one_joint_is_one_message(
    server: viser.ViserServer, viewer: Viewer, records: list[StepRecord]
) -> None:
    """One joint is one message."""
    viewer.update(records[0])
    before = queued(server)
    joints = list(records[0].joint_positions_rad)
    joints[3] += 0.1
    viewer.update(changed(records[0], joint_positions_rad=joints))
    assert queued(server) == before + 1


def test_arrows_show_the_twists(viewer: Viewer, records: list[StepRecord], node: Find) -> None:
    """Arrows show the twists."""
    direct, added = [0.1, 0.0, 0.0, 0, 0, 0], [0.0, -0.05, 0.0, 0, 0, 0]
    viewer.update(changed(records[0], direct_twist=direct, assistance_twist=added))
    user, assist = node("/hindsight/arrow/user"), node("/hindsight/arrow/assist")
    assert user.visible and assist.visible
    assert user.points[0, 0] == pytest.approx([0, 0, 0])
    assert user.points[0, 1, 0] > 0 and user.points[0, 1, 1:] == pytest.approx([0, 0])
    assert assist.points[0, 1, 1] < 0
    lengths = [np.linalg.norm(h.points[0, 1]) for h in (user, assist)]
    assert lengths[0] > lengths[1]  # the faster, the longer
    assert node("/hindsight/arrow").position == pytest.approx(records[0].hand_position_m, abs=1e-4)


def test_no_arrow_at_rest_and_none_of_assistance_that_is_off(
    viewer: Viewer, records: list[StepRecord], node: Find
) -> None:
    """No arrow at rest and none of assistance that is off."""
    viewer.update(changed(records[0], direct_twist=[0.0] * 6, enabled=False))
    assert not node("/hindsight/arrow/user").visible
    assert not node("/hindsight/arrow/assist").visible


def test_the_drop_line_reaches_from_the_hand_to_the_table(
    viewer: Viewer, records: list[StepRecord], node: Find
) -> None:
    """The drop line reaches from the hand to the table."""
    viewer.update(changed(records[0], hand_position_m=[0.5, -0.1, 0.25]))
    assert node("/hindsight/plumb").position == pytest.approx([0.5, -0.1, 0.0], abs=1e-4)
    assert node("/hindsight/plumb/line").scale == pytest.approx((1, 1, 0.25), abs=6e-4)


@pytest.mark.parametrize(
    ("layer", "name"),
    [("user", "arrow/user"), ("assist", "arrow/assist"), ("ghosts", "ghost/glass")],
)
def test_layers_hide_and_show_their_node(
    viewer: Viewer, records: list[StepRecord], goals: Goals, node: Find, layer: str, name: str
) -> None:
    """Layers hide and show their node."""
    viewer.update(changed(records[0], belief=[0.1, 0.2, 0.7], direct_twist=[0.1] * 6), goals)
    assert node(f"/hindsight/{name}").visible
    assert viewer.set_layers({layer: False})[layer] is False
    assert not node(f"/hindsight/{name}").visible
    viewer.set_layers({layer: True})
    assert node(f"/hindsight/{name}").visible


def test_bad_layers_change_nothing(viewer: Viewer) -> None:
    """Bad layers change nothing."""
    before = viewer.layers
    for changes in (
        {"user": False, "clouds": True},
        {"user": "no"},
        {"user": 0},
        {"slice_plane": "ceiling"},
        {"slice_of": "teapot"},
    ):
        with pytest.raises(LayersError, match="valid are"):
            viewer.set_layers(changes)
    assert viewer.layers == before
    assert viewer.set_layers({"slice_of": "glass", "slice_plane": "vertical"}) == before | {
        "slice_of": "glass",
        "slice_plane": "vertical",
    }


def test_ghosts_are_of_likely_goals_at_their_best_targets(
    viewer: Viewer, records: list[StepRecord], goals: Goals, server: viser.ViserServer, node: Find
) -> None:
    """Ghosts are of likely goals at their best targets."""
    likely = changed(records[0], belief=[0.3, 0.1, 0.6], best_targets=[1, 2, 5])
    viewer.update(likely, goals)
    glass, canteen = node("/hindsight/ghost/glass"), node("/hindsight/ghost/canteen")
    assert server.scene.get_handle_by_name("/hindsight/ghost/block") is None
    assert glass.position == pytest.approx(goals.positions[5], abs=1e-4)
    assert canteen.position == pytest.approx(goals.positions[1], abs=1e-4)
    assert (glass.opacity, canteen.opacity) == pytest.approx((0.36, 0.18))
    assert node("/hindsight/ghost/glass/edges").visible
    assert not node("/hindsight/ghost/canteen/edges").visible
    viewer.update(changed(likely, belief=[0.2, 0.2, 0.6]), goals)
    assert glass.visible and not canteen.visible


def test_the_target_ring_follows_its_object(
    viewer: Viewer, records: list[StepRecord], node: Find
) -> None:
    """The target ring follows its object."""
    ring = node("/hindsight/target_ring")
    assert not ring.visible
    viewer.set_target("glass")
    poses = list(records[0].object_poses)
    poses[14:17] = [0.4, -0.3, 0.2]
    viewer.update(changed(records[0], object_poses=poses))
    assert ring.visible
    assert ring.position == pytest.approx([0.4, -0.3, 0.007], abs=1e-4)
    with pytest.raises(SubjectError, match="canteen, block, glass"):
        viewer.set_target("teapot")
    viewer.set_target(None)
    assert not ring.visible


def test_tags_stand_above_the_objects(
    viewer: Viewer, records: list[StepRecord], node: Find
) -> None:
    """Tags stand above the objects."""
    viewer.update(records[0])
    upright = node("/tag/block").position[2]
    assert upright == pytest.approx(0.10 + 0.035, abs=1e-3)  # the block is 0.10 m high
    poses = list(records[0].object_poses)
    poses[10:14] = [np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0]  # the block lies on its side
    viewer.update(changed(records[0], object_poses=poses))
    assert node("/tag/block").position[2] == pytest.approx(0.03 + 0.035, abs=1e-3)
    viewer.set_layers({"tags": False})
    assert not node("/tag/block").visible


def test_labels_say_the_belief(
    server: viser.ViserServer, scene: Scene, records: list[StepRecord], node: Find
) -> None:
    """Labels say the belief."""
    viewer = Viewer(server, scene, labels=True)
    viewer.update(changed(records[0], belief=[0.09, 0.19, 0.72]))
    assert node("/tag/glass/label").text == "glass 0.72"
    assert node("/tag/glass/label").visible
    viewer.set_layers({"tags": False})
    assert not node("/tag/glass/label").visible
    viewer.close()


def test_the_probe_keeps_large_sequence_numbers_apart(
    viewer: Viewer, records: list[StepRecord], node: Find
) -> None:
    """The probe keeps large sequence numbers apart."""
    for sequence in (1_000_000, 1_000_001, 1_000_002):
        viewer.update(changed(records[0], sequence=sequence))
        assert node("/probe").position[0] == sequence


def test_the_path_grows_is_kept_while_hidden_and_ends_with_the_trial(
    server: viser.ViserServer, viewer: Viewer, records: list[StepRecord], node: Find
) -> None:
    """The path grows is kept while hidden and ends with the trial."""
    for step in range(60):
        hand = [0.4 + 0.01 * step, 0.0, 0.2]
        viewer.update(changed(records[0], step=step, time_s=0.1 * step, hand_position_m=hand))
    assert server.scene.get_handle_by_name("/hindsight/path/0") is None
    viewer.set_layers({"path": True})
    chains = [np.asarray(node(f"/hindsight/path/{i}").points) for i in range(3)]
    assert sum(len(chain) for chain in chains) == 60 + 2  # neighbours share a point
    assert chains[0][-1] == pytest.approx(chains[1][0])
    viewer.update(changed(records[0], step=0))
    assert server.scene.get_handle_by_name("/hindsight/path/0") is None


def test_the_theme_recolours_in_place(
    viewer: Viewer, records: list[StepRecord], goals: Goals, node: Find
) -> None:
    """The theme recolours in place."""
    viewer.update(changed(records[0], belief=[0.1, 0.2, 0.7]), goals)
    arrow, link = node("/hindsight/arrow/user"), node("/hindsight/arm/base/mesh")
    dark_mesh = link.glb_data
    viewer.set_theme("light")
    assert viewer.theme == "light"
    assert tuple(arrow.colors) == rgb(LIGHT.user) != rgb(DARK.user)
    assert link.glb_data != dark_mesh
    assert node("/hindsight/ghost/glass").color == rgb(LIGHT.markers["sky"])
    assert node("/hindsight/floor").plane_color == rgb(LIGHT.floor[0])
    viewer.set_theme("dark")
    assert link.glb_data == dark_mesh
    with pytest.raises(ThemeError, match="dark, light"):
        viewer.set_theme("sepia")


def test_another_view_can_take_the_server_over(
    server: viser.ViserServer, viewer: Viewer, scene: Scene, records: list[StepRecord], node: Find
) -> None:
    """Another view can take the server over."""
    viewer.update(records[0])
    viewer.close()
    server.scene.reset()
    second = Viewer(server, scene, "light", detail="plain")
    second.update(records[1])
    assert node("/hindsight/arrow").position == pytest.approx(records[1].hand_position_m, abs=1e-4)
    assert server.scene.get_handle_by_name("/hindsight/floor") is None  # plain has none
    second.close()


def test_the_slice_is_drawn_beside_the_loop(
    viewer: Viewer,
    records: list[StepRecord],
    goals: Goals,
    settings: AssistanceSettings,
    node: Find,
) -> None:
    """The slice is drawn beside the loop."""
    viewer.update(records[0], goals, settings)
    for _ in range(1000):
        if viewer.value_range is not None:
            break
        viewer._slice._end.wait(0.02)
    low, high = viewer.value_range or (0.0, 0.0)
    assert low < high
    assert node("/hindsight/slice").position == pytest.approx([0.525, 0.0, 0.004])
    viewer.set_layers({"slice": False})
    assert viewer.value_range is None
    assert not node("/hindsight/slice").visible
