"""The export form by itself."""

from pathlib import Path

import pytest

from studio.ui import theme
from studio.ui.review.export_panel import ExportPanel


@pytest.fixture
def panel(qtbot, qapp) -> ExportPanel:
    theme.apply(qapp)
    made = ExportPanel()
    qtbot.addWidget(made)
    return made


def test_another_project_exports_into_its_own_folder(panel: ExportPanel, tmp_path: Path) -> None:
    for name in ("One", "Two"):
        panel.show_target("Hello_001", tmp_path / name / "exports", ready=True)
        assert panel.folder.text() == str(tmp_path / name / "exports")


def test_a_folder_that_was_chosen_stays(panel: ExportPanel, tmp_path: Path) -> None:
    panel.show_target("Hello_001", tmp_path / "One", ready=True)
    panel.folder.setText(str(tmp_path / "Mine"))
    panel.show_target("Hello_001", tmp_path / "Two", ready=True)
    assert panel.folder.text() == str(tmp_path / "Mine")
