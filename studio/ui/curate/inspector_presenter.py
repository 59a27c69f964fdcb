"""What is said of the takes that are selected, and what is changed about them."""

from __future__ import annotations

from PySide6.QtCore import QObject

from studio.ui.curate.findings import all_marks, placed
from studio.ui.curate.inspector_view import Inspector
from studio.ui.curate.model import CurateModel
from studio.ui.session import Session


class InspectorPresenter(QObject):
    """Keeps the inspector at the selected rows."""

    def __init__(self, inspector: Inspector, model: CurateModel, _session: Session) -> None:
        super().__init__(inspector)
        self._inspector, self._model = inspector, model
        model.rows_changed.connect(lambda: inspector.set_editable(model.editable))
        model.chosen_changed.connect(self._show)
        model.graded.connect(self._show)
        inspector.choice_changed.connect(model.choose)
        inspector.findings.chosen.connect(model.go_to)
        inspector.findings.exclude_requested.connect(
            lambda mark: model.exclude((mark.t, mark.t + mark.duration))
        )

    def _show(self) -> None:
        rows = self._model.chosen_rows
        names = sorted({s.performer for s in self._model.dataset.selections if s.performer})
        self._inspector.show_rows(rows, names)
        findings = self._inspector.findings
        row = rows[0] if len(rows) == 1 else None
        if row is None or row.take is None:
            findings.show_marks((), (), self.tr("Select one take to see its checks.") if rows else "")
        elif row.report is None:
            findings.show_marks((), (), self.tr("Being checked…"))
        else:
            sentence = self.tr("Nothing is wrong with this take.")
            findings.show_marks(all_marks(row.report), placed(row.report), sentence)
