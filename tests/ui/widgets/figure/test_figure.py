"""The figure: a person seen from the front, side and above, in OpenGL and without."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtWidgets import QToolButton
from pytestqt.qtbot import QtBot

from studio import formats
from studio.motion.skeleton import Skeleton
from studio.project.avatars import OWN
from studio.render import body
from studio.render.background import CLEAR, ROOM, Background
from studio.render.camera import FRAMINGS, Orbit, project, to_picture
from studio.render.world_pose import WorldPose
from studio.ui import theme
from studio.ui.widgets.figure.figure import FAR_TOO_SLOW, REST_COST, TOO_SLOW, StickFigure
from studio.ui.widgets.figure.pane import Pane
from studio.ui.widgets.figure.picture import EASY, FINE_EASY, FINE_SLOW, SHARES, SLOW, USUAL, Detail
from studio.ui.widgets.figure.sketch import draw_figure
from tests.formats.avatars import Maker


def t_pose() -> tuple[Skeleton, np.ndarray]:
    skeleton = Skeleton.humanoid()
    world, _ = skeleton.forward(skeleton.rest_positions, skeleton.rest_rotations)
    return skeleton, world


def body_pixels(image: QImage) -> np.ndarray:
    """Where the picture is brighter than its ground: (rows, columns) booleans."""
    grey = image.convertToFormat(QImage.Format.Format_Grayscale8)
    data = np.frombuffer(grey.constBits(), np.uint8).reshape(grey.height(), grey.bytesPerLine())
    return data[:, : grey.width()] > 90


@pytest.fixture
def figure(qtbot, qapp) -> StickFigure:
    theme.apply(qapp)
    made = StickFigure()
    made.resize(480, 400)
    qtbot.addWidget(made, before_close_func=lambda widget: widget.dispose())
    made.show()
    return made


@pytest.fixture
def warm(figure: StickFigure, qtbot) -> StickFigure:
    figure.warm_up()
    qtbot.waitUntil(lambda: figure.warm, timeout=30_000)
    return figure


def drawn(figure: StickFigure, qtbot) -> QImage:
    """The next picture made by OpenGL."""
    before = figure.renders
    figure.show_stance(WorldPose(*t_pose()))
    qtbot.waitUntil(lambda: figure.renders > before)
    assert figure.picture is not None
    return figure.picture


def test_an_empty_room_says_what_goes_there(figure: StickFigure) -> None:
    assert figure.empty
    figure.clear("Drop a sound here.")
    picture = figure.grab().toImage()
    colours = {picture.pixel(x, y) for x in range(100, 380, 2) for y in range(100, 330, 2)}
    assert len(colours) > 10


@pytest.mark.parametrize("opengl", [False, True])
def test_a_t_pose_is_wider_than_it_is_seen_from_the_side(figure, opengl, qtbot) -> None:
    if opengl:
        figure.warm_up()
        qtbot.waitUntil(lambda: figure.warm, timeout=30_000)
    widths = {}
    for view in ("front", "side"):
        figure.set_view(view)
        image = drawn(figure, qtbot) if opengl else _sketch(figure, qtbot)
        columns = np.flatnonzero(body_pixels(image)[60:].any(axis=0))
        widths[view] = np.ptp(columns) / image.width()
    assert widths["front"] > 2 * widths["side"]


def _sketch(figure: StickFigure, qtbot) -> QImage:
    figure.show_stance(WorldPose(*t_pose()))
    qtbot.waitUntil(lambda: not figure.drawing_soon)
    return figure.grab().toImage()


def test_the_whole_body_fits_the_picture(warm: StickFigure, qtbot) -> None:
    for size in ((480, 400), (300, 600), (900, 300)):
        warm.resize(*size)
        image = drawn(warm, qtbot)
        seen = body_pixels(image)
        assert not seen[0].any()
        assert not seen[-1].any()
        assert seen.any()


def test_the_avatars_left_is_at_the_right_of_the_picture() -> None:
    skeleton, world = t_pose()
    seen = project(to_picture(world), Orbit.preset("front"), 640, 480, 1.0)
    left, right = (seen[skeleton.bone_names.index(name), 0] for name in ("LeftHand", "RightHand"))
    assert left > 320 > right


def test_the_sketch_and_opengl_agree_where_the_head_is(figure: StickFigure, qtbot) -> None:
    sketch = body_pixels(_sketch(figure, qtbot))[45:]
    figure.warm_up()
    qtbot.waitUntil(lambda: figure.warm, timeout=30_000)
    real = body_pixels(drawn(figure, qtbot))[45:]
    tops = [np.flatnonzero(seen.any(axis=1))[0] for seen in (sketch, real)]
    assert abs(tops[0] - tops[1]) <= 6


def test_the_picture_is_as_large_as_the_widget(warm: StickFigure, qtbot) -> None:
    warm.resize(333, 257)
    image = drawn(warm, qtbot)
    ratio = warm.devicePixelRatioF()
    assert (image.width(), image.height()) == (int(333 * ratio), int(257 * ratio))


def test_a_ghost_has_a_colour_of_its_own_and_goes_again(warm: StickFigure, qtbot) -> None:
    skeleton, world = t_pose()
    plain = drawn(warm, qtbot)
    warm.show_ghost_stance(WorldPose(skeleton, world + np.array([0.4, 0, 0])))
    with_ghost = drawn(warm, qtbot)
    warm.show_ghost_stance(None)
    assert _orange(with_ghost) > 20 * max(_orange(plain), 1)
    assert _orange(drawn(warm, qtbot)) == _orange(plain)


def _orange(image: QImage) -> int:
    colours = (
        image.pixelColor(x, y) for x in range(0, image.width(), 3) for y in range(0, image.height(), 3)
    )
    return sum(c.red() > c.blue() + 40 for c in colours)


def test_the_frame_is_red_only_while_rolling(figure: StickFigure) -> None:
    def corner() -> QColor:
        return figure.grab().toImage().pixelColor(1, 200)

    assert corner() != QColor(theme.DARK.record)
    figure.set_rolling(True)
    assert corner() == QColor(theme.DARK.record)
    figure.set_rolling(False)
    assert corner() != QColor(theme.DARK.record)


def test_dragging_turns_and_a_double_click_turns_back(figure: StickFigure, qtbot) -> None:
    first = figure.orbit
    qtbot.mousePress(figure, Qt.MouseButton.LeftButton, pos=QPoint(200, 200))
    qtbot.mouseMove(figure, QPoint(260, 200))
    qtbot.mouseRelease(figure, Qt.MouseButton.LeftButton, pos=QPoint(260, 200))
    assert figure.orbit.azimuth != first.azimuth
    qtbot.mouseDClick(figure, Qt.MouseButton.LeftButton, pos=QPoint(200, 200))
    assert figure.orbit == first


def test_keys_turn_and_zoom(figure: StickFigure, qtbot) -> None:
    azimuth, zoom = figure.orbit.azimuth, figure.orbit.zoom
    qtbot.keyClick(figure, Qt.Key.Key_Right)
    qtbot.keyClick(figure, Qt.Key.Key_Plus)
    assert figure.orbit.azimuth == azimuth + 8
    assert figure.orbit.zoom < zoom


def test_a_pose_that_is_not_finite_is_not_drawn(figure: StickFigure) -> None:
    skeleton, world = t_pose()
    figure.show_stance(WorldPose(skeleton, world * np.nan))
    assert figure.empty
    figure.show_stance(WorldPose(Skeleton.humanoid(()), np.empty((0, 3))))
    assert figure.empty


def test_any_skeleton_can_be_shown(warm: StickFigure, qtbot) -> None:
    for names in (("Hips",), ("Head", "Neck"), ("Tail", "Ear"), ("Hips", "Spine", "Head")):
        skeleton = Skeleton.humanoid(names)
        world, _ = skeleton.forward(skeleton.rest_positions, skeleton.rest_rotations)
        before = warm.renders
        warm.show_stance(WorldPose(skeleton, world))
        qtbot.waitUntil(lambda before=before: warm.renders > before)


def test_capsules_reach_from_joint_to_joint() -> None:
    skeleton, world = t_pose()
    plan = body.Plan.of(skeleton)
    vertices, normals = body.limbs(plan, world, 1.0)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
    per_limb = vertices.reshape(len(plan.starts), -1, 3)
    middle = (world[plan.starts] + world[plan.ends]) / 2
    assert np.abs(per_limb.mean(axis=1) - middle).max() < 0.03
    assert plan.scale(world * 3) == pytest.approx(3 * plan.scale(world))


def test_disposing_twice_is_harmless(warm: StickFigure) -> None:
    warm.dispose()
    warm.dispose()
    warm.show_stance(WorldPose(*t_pose()))


def test_an_avatar_that_draws_too_slowly_becomes_a_figure_of_its_size(figure, qtbot, tmp_path) -> None:
    avatar = formats.read_avatar(Maker(0).write(tmp_path / "a.vrm"))
    figure.set_avatar(avatar)
    with qtbot.waitSignal(figure.avatar_too_slow):
        for _ in range(20):
            figure.note_cost(TOO_SLOW + 1.0)
    assert figure.avatar is not None
    assert figure.avatar.skeleton is avatar.skeleton
    assert not figure.avatar.surfaces


def test_in_front_of_viewers_an_avatar_that_draws_too_slowly_stays(
    figure: StickFigure, qtbot: QtBot, tmp_path: Path
) -> None:
    avatar = formats.read_avatar(Maker(0).write(tmp_path / "a.vrm"))
    figure.keeps_avatar = True
    figure.set_avatar(avatar)
    told = []
    figure.avatar_too_slow.connect(lambda: told.append(1))
    for _ in range(20):
        figure.note_cost(FAR_TOO_SLOW + 1.0)
    assert figure.avatar is avatar
    assert told == [1], "once is enough"


def test_without_opengl_the_lines_have_the_avatars_proportions(figure, qtbot, tmp_path, monkeypatch) -> None:
    def no_opengl(*_: object) -> None:
        raise RuntimeError("no OpenGL")

    monkeypatch.setattr("studio.ui.widgets.figure.figure.RenderScene", no_opengl)
    figure.warm_up()
    figure.set_avatar(formats.read_avatar(Maker(0, head=3.0).write(tmp_path / "a.vrm")))
    skeleton, world = t_pose()
    figure.show_stance(WorldPose(skeleton, world, skeleton.rest_rotations))
    qtbot.waitUntil(lambda: not (figure.drawing_soon or figure.getting_ready))
    assert body_pixels(figure.grab().toImage())[60:].any()


def test_nobody_stands_in_for_an_avatar_that_is_not_drawn_yet(figure: StickFigure, qtbot: QtBot) -> None:
    avatar = formats.read_avatar(OWN)
    figure.set_avatar(avatar)
    figure.clear("Getting ready…", "mdi6.human")
    nobody = figure.grab().toImage()
    # The view buttons come with somebody to see.
    figure.view_buttons_shown = False
    figure.show_stance(WorldPose.rest_pose(avatar.skeleton))
    qtbot.waitUntil(lambda: not figure.drawing_soon)
    assert figure.getting_ready
    assert figure.grab().toImage() == nobody
    figure.warm_up()
    qtbot.waitUntil(lambda: not figure.getting_ready, timeout=30_000)
    assert figure.grab().toImage() != nobody


@pytest.mark.parametrize("framing", FRAMINGS)
def test_the_lines_are_framed_by_the_head_of_their_own_body(framing: str, qapp) -> None:
    theme.apply(qapp)
    avatar = formats.read_avatar(OWN)
    rest = WorldPose.rest_pose(avatar.skeleton)
    image = QImage(480, 400, QImage.Format.Format_RGB32)
    image.fill(QColor("black"))
    painter = QPainter(image)
    orbit = Orbit.preset("front").framed(framing)
    draw_figure(painter, QRectF(image.rect()), orbit, rest.skeleton, rest.joints)
    painter.end()
    assert not body_pixels(image)[:4].any(), "nobody's head is cut off"


def test_what_stays_as_it_is_is_not_drawn_again(warm: StickFigure, qtbot) -> None:
    drawn(warm, qtbot)
    qtbot.waitUntil(lambda: not warm.drawing_soon)
    made = warm.renders
    for _ in range(5):
        warm.show_stance(WorldPose(*t_pose()))
        assert not warm.drawing_soon
    assert warm.renders == made
    skeleton, world = t_pose()
    warm.show_stance(WorldPose(skeleton, world + np.array([0.1, 0.0, 0.0])))
    qtbot.waitUntil(lambda: warm.renders > made)


@pytest.mark.parametrize("opengl", [False, True])
def test_any_background_is_behind_the_figure(figure: StickFigure, qtbot, opengl: bool) -> None:
    if opengl:
        figure.warm_up()
        qtbot.waitUntil(lambda: figure.warm)
    corners = {}
    for background in (Background("#204060"), CLEAR, ROOM):
        figure.set_background(background)
        figure.show_stance(WorldPose(*t_pose()))
        qtbot.waitUntil(lambda: not figure.drawing_soon)
        image = figure.grab().toImage()
        corners[background.text] = {image.pixelColor(2 + x, 380).name() for x in range(0, 30, 3)}
    assert corners["#204060"] == {"#204060"}
    assert corners["transparent"] == {theme.colour("surface").name(), theme.colour("raised").name()}
    assert corners["room"].isdisjoint(corners["transparent"])


def test_framings_keep_the_side_and_are_pressed(figure: StickFigure, qtbot) -> None:
    figure.show_stance(WorldPose(*t_pose()))
    qtbot.waitUntil(lambda: not figure.drawing_soon)
    side = figure.orbit.azimuth
    for name, zoom in FRAMINGS.items():
        button = figure.findChild(QToolButton, f"view_{name}")
        assert button is not None
        button.click()
        assert (figure.orbit.zoom, figure.orbit.azimuth) == (zoom, side)
        assert button.isChecked()
    figure.resize(300, 300)
    figure.show_stance(WorldPose(*t_pose()))
    side_button = figure.findChild(QToolButton, "view_side")
    assert side_button is not None
    qtbot.waitUntil(lambda: not side_button.isVisible())
    assert button.isVisible(), "how near is what the mouse does worse"


def test_a_face_without_a_body_is_seen_from_close_by(qtbot, tmp_path) -> None:
    pane = Pane("p", "", "", "mdi6.human", "figure")
    qtbot.addWidget(pane, before_close_func=lambda _: pane.figure.dispose())
    pane.set_avatar(formats.read_avatar(Maker(0).write(tmp_path / "a.vrm")))
    face = WorldPose(Skeleton.humanoid(()), np.empty((0, 3)), None, {"A": 1.0})
    pane.show_stance(face)
    assert pane.figure.seen.framing == "face"
    pane.figure.set_view("bust")
    assert pane.figure.seen.framing == "bust", "who chooses another view has it"
    pane.figure.set_view("body")
    pane.show_stance(WorldPose(*t_pose()))
    assert pane.figure.seen.framing == "body"


def after(detail: Detail, *costs: float) -> float:
    for cost in costs:
        detail.saw(cost)
    return detail.share


def test_pictures_that_always_take_too_long_get_coarser_step_by_step() -> None:
    detail, slow = Detail(), [2 * SLOW] * 12
    assert [after(detail, *slow) for _ in range(4)] == [*SHARES[USUAL + 1 :], SHARES[-1], SHARES[-1]]


def test_a_computer_that_is_held_up_for_a_while_is_not_slow() -> None:
    detail = Detail()
    assert after(detail, *[2 * SLOW] * 11, SLOW / 2, *[2 * SLOW] * 11) == 1.0


def test_it_gets_finer_only_where_that_would_not_be_slow_again() -> None:
    detail = Detail()
    after(detail, *[2 * SLOW] * 12)
    assert after(detail, *[EASY * 0.6] * 40) == SHARES[USUAL + 1]  # twice the pixels would be too slow
    assert after(detail, *[EASY * 0.4] * 12) == 1.0


def test_only_what_costs_nearly_nothing_is_drawn_finer_than_the_screen() -> None:
    detail = Detail()
    assert after(detail, *[EASY / 4] * 20) == 1.0
    assert after(detail, *[FINE_EASY / 5] * 12) == SHARES[0] > 1.0
    assert after(detail, *[FINE_SLOW * 1.1] * 12) == 1.0, "pictures a second come first"


def test_what_holds_up_everything_is_coarse_at_once_and_fine_again_when_that_is_over() -> None:
    detail = Detail()
    detail.go_coarsest()
    assert detail.share == SHARES[-1]
    assert after(detail, *[FINE_EASY / 10] * 60) >= 1.0


def test_what_rests_is_drawn_in_full_whatever_it_cost_while_it_moved(warm: StickFigure, qtbot) -> None:
    warm.set_background(CLEAR)
    drawn(warm, qtbot)
    qtbot.waitUntil(lambda: not warm.drawing_soon)
    full = warm.picture
    for _ in range(12):
        warm.note_cost(2 * SLOW)
    warm.set_orbit(Orbit.preset("side"))
    before = warm.renders
    qtbot.waitUntil(lambda: warm.renders > before)
    assert warm.picture.width() < full.width()
    warm.note_cost(REST_COST)
    qtbot.waitUntil(lambda: not warm.drawing_soon)
    assert warm.picture.size() == full.size()


def test_another_size_begins_anew() -> None:
    detail = Detail()
    after(detail, *[2 * SLOW] * 12)
    detail.begin_anew()
    assert detail.share == 1.0
