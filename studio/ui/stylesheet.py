"""The style sheet's text; @tokens are filled in by studio.ui.theme."""

TEMPLATE = """
* { outline: 0; }
QWidget { color: @text; selection-background-color: @accent_soft; selection-color: @text; }
QMainWindow, QDialog, QWidget#page { background: @ground; }
QToolTip { background: @raised; color: @text; border: 1px solid @line; padding: 4px 8px; }

QLabel { background: transparent; }
QLabel:disabled { color: @disabled; }
QLabel[role="display"] { font-size: 26px; font-weight: 600; }
QLabel[role="title"] { font-size: 16px; font-weight: 600; }
QLabel[role="heading"] { font-size: 11px; font-weight: 600; color: @muted; }
QLabel[role="muted"] { color: @muted; }
QLabel[role="caption"] { font-size: 11px; color: @muted; }
QLabel[role="good"] { color: @good; }
QLabel[role="warn"] { color: @warn; }
QLabel[role="bad"] { color: @bad; }

QFrame[role="card"] { background: @surface; border: 1px solid @line; border-radius: 6px; }
QFrame[role="bar"] { background: @surface; border: 0; border-bottom: 1px solid @line; }
QFrame[role="hairline"] { background: @line; border: 0; max-height: 1px; min-height: 1px; }
QFrame[role="toast"] { background: @raised; border: 1px solid @line; border-radius: 6px; }
QFrame[role="toast_bad"] { background: @raised; border: 1px solid @bad; border-radius: 6px; }

QPushButton, QToolButton {
    background: @raised; border: 1px solid @line; border-radius: 6px; padding: 5px 12px; min-height: 18px;
}
QToolButton { padding: 5px 8px; }
QPushButton:hover, QToolButton:hover { border-color: @disabled; }
QPushButton:pressed, QToolButton:pressed { background: @surface; }
QPushButton:checked, QToolButton:checked { background: @accent_soft; border-color: @accent; }
QPushButton:focus, QToolButton:focus { border-color: @accent; }
QPushButton:disabled, QToolButton:disabled { color: @disabled; background: @surface; border-color: @line; }
QToolButton::menu-indicator, QPushButton::menu-indicator { image: none; width: 0; }
QPushButton[role="primary"], QToolButton[role="primary"] {
    background: @accent; color: @on_accent; border-color: @accent; font-weight: 600; padding: 6px 16px;
}
QPushButton[role="primary"]:hover, QToolButton[role="primary"]:hover { border-color: @text; }
QPushButton[role="primary"]:focus, QToolButton[role="primary"]:focus { border-color: @text; }
QPushButton[role="primary"]:disabled { background: @raised; color: @disabled; border-color: @line; }
QPushButton[role="danger"] { color: @bad; }
QPushButton[role="record"] {
    background: @raised; border: 2px solid @record; color: @text; font-size: 16px; font-weight: 600;
    border-radius: 22px; min-height: 40px; padding: 0 24px;
}
QPushButton[role="record"]:hover, QPushButton[role="record"]:focus { border-color: @text; }
QPushButton[role="record"]:checked { background: @record; color: @on_record; }
QPushButton[role="record"]:disabled { border-color: @line; color: @disabled; }
QPushButton[role="quiet"], QToolButton[role="quiet"] {
    background: transparent; border-color: transparent; color: @muted; padding: 4px 8px;
}
QPushButton[role="quiet"]:hover, QToolButton[role="quiet"]:hover { background: @raised; color: @text; }
QPushButton[role="quiet"]:focus, QToolButton[role="quiet"]:focus { border-color: @accent; }
QPushButton[role="quiet"]:checked, QToolButton[role="quiet"]:checked { background: @accent_soft; color: @text; }
QPushButton[role="quiet"]:disabled, QToolButton[role="quiet"]:disabled { color: @disabled; }
QPushButton[role="fold"] {
    background: transparent; border-color: transparent; padding: 5px 2px; text-align: left;
}
QPushButton[role="fold"]:hover, QPushButton[role="fold"]:checked:hover { background: @raised; }
QPushButton[role="fold"]:checked { background: transparent; border-color: transparent; }
QPushButton[role="fold"]:focus { border-color: @accent; }
QPushButton[role="chip"], QToolButton[role="chip"] { border-radius: 12px; padding: 2px 10px; font-size: 11px; }
QPushButton[role="big"] { text-align: left; padding: 10px 14px; background: @surface; }
QPushButton[role="big"]:hover { background: @raised; }

QLineEdit, QPlainTextEdit, QTextEdit, QSpinBox, QDoubleSpinBox, QComboBox {
    background: @raised; border: 1px solid @line; border-radius: 6px; padding: 4px 8px; min-height: 20px;
}
QLineEdit QToolButton { background: transparent; border: 0; padding: 0; min-height: 0; }
QLineEdit:hover, QSpinBox:hover, QDoubleSpinBox:hover, QComboBox:hover { border-color: @disabled; }
QLineEdit:focus, QPlainTextEdit:focus, QTextEdit:focus, QSpinBox:focus, QDoubleSpinBox:focus,
QComboBox:focus { border-color: @accent; }
QLineEdit:disabled, QSpinBox:disabled, QDoubleSpinBox:disabled, QComboBox:disabled {
    color: @disabled; background: @surface;
}
QComboBox { padding-right: 24px; }
QComboBox::drop-down { border: 0; width: 22px; }
QComboBox::down-arrow { image: url("@icons/chevron-down.svg"); width: 12px; height: 12px; }
QComboBox QAbstractItemView { background: @raised; border: 1px solid @line; padding: 4px; }
QComboBox QAbstractItemView::item { min-height: 24px; padding: 0 6px; border-radius: 4px; }
QSpinBox, QDoubleSpinBox { padding-right: 20px; }
QSpinBox::up-button, QDoubleSpinBox::up-button {
    subcontrol-origin: border; subcontrol-position: top right; width: 18px; border: 0;
}
QSpinBox::down-button, QDoubleSpinBox::down-button {
    subcontrol-origin: border; subcontrol-position: bottom right; width: 18px; border: 0;
}
QSpinBox::up-arrow, QDoubleSpinBox::up-arrow { image: url("@icons/chevron-up.svg"); width: 10px; height: 10px; }
QSpinBox::down-arrow, QDoubleSpinBox::down-arrow {
    image: url("@icons/chevron-down.svg"); width: 10px; height: 10px;
}

QCheckBox, QRadioButton { spacing: 8px; background: transparent; }
QCheckBox::indicator, QRadioButton::indicator {
    width: 14px; height: 14px; border: 1px solid @disabled; background: @raised; border-radius: 4px;
}
QRadioButton::indicator { border-radius: 8px; }
QCheckBox::indicator:hover, QRadioButton::indicator:hover { border-color: @text; }
QCheckBox:focus, QRadioButton:focus { color: @accent; }
QCheckBox::indicator:checked {
    background: @accent; border-color: @accent; image: url("@icons/check-@name.svg");
}
QRadioButton::indicator:checked { background: @accent; border: 4px solid @raised; width: 8px; height: 8px; }

QSlider::groove:horizontal { height: 4px; background: @line; border-radius: 2px; }
QSlider::sub-page:horizontal { background: @accent; border-radius: 2px; }
QSlider::handle:horizontal {
    background: @text; width: 12px; height: 12px; margin: -4px 0; border-radius: 6px;
}
QSlider::handle:horizontal:focus { background: @accent; }
QSlider::sub-page:horizontal:disabled, QSlider::handle:horizontal:disabled { background: @disabled; }

QProgressBar {
    background: @raised; border: 0; border-radius: 3px; text-align: center; max-height: 6px; min-height: 6px;
    color: transparent;
}
QProgressBar::chunk { background: @accent; border-radius: 3px; }

QScrollArea, QScrollArea > QWidget > QWidget#scrolled { background: transparent; border: 0; }
QScrollBar:vertical { background: transparent; width: 10px; margin: 2px; }
QScrollBar:horizontal { background: transparent; height: 10px; margin: 2px; }
QScrollBar::handle { background: @line; border-radius: 3px; min-height: 32px; min-width: 32px; }
QScrollBar::handle:hover { background: @disabled; }
QScrollBar::add-line, QScrollBar::sub-line { width: 0; height: 0; }
QScrollBar::add-page, QScrollBar::sub-page { background: transparent; }

QListView, QTableView, QTreeView, QListWidget, QTableWidget, QTreeWidget {
    background: @surface; alternate-background-color: @surface; border: 0; gridline-color: @line;
}
QAbstractItemView::item { padding: 4px 6px; }
QAbstractItemView::item:hover { background: @raised; }
QAbstractItemView::item:selected { background: @accent_soft; color: @text; }
QHeaderView { background: @surface; border: 0; }
QHeaderView::section {
    background: @surface; color: @muted; border: 0; border-bottom: 1px solid @line; padding: 6px;
    font-size: 11px;
}
QTableCornerButton::section { background: @surface; border: 0; }

QMenuBar { background: @surface; border-bottom: 1px solid @line; }
QMenuBar::item { background: transparent; padding: 5px 10px; border-radius: 4px; }
QMenuBar::item:selected { background: @raised; }
QMenu { background: @raised; border: 1px solid @line; border-radius: 6px; padding: 6px; }
QMenu::item { padding: 6px 28px 6px 12px; border-radius: 4px; }
QMenu::item:selected { background: @accent_soft; }
QMenu::item:disabled { color: @disabled; }
QMenu::separator { height: 1px; background: @line; margin: 6px 4px; }
QMenu::icon { padding-left: 8px; }

QTabBar#rooms { background: transparent; }
QTabBar#rooms::tab {
    background: transparent; color: @muted; padding: 0 18px; margin: 0; min-height: 46px; border: 0;
    border-bottom: 2px solid transparent; border-top: 2px solid transparent;
}
QTabBar#rooms::tab:hover { color: @text; }
QTabBar#rooms::tab:selected { color: @text; border-bottom-color: @accent; }
QTabBar#rooms::tab:disabled { color: @disabled; }
QTabBar#rooms:focus { text-decoration: underline; }
QTabWidget::pane { border: 0; }
QTabBar::tab {
    background: transparent; color: @muted; padding: 6px 12px; border: 0; border-bottom: 2px solid transparent;
}
QTabBar::tab:hover { color: @text; }
QTabBar::tab:selected { color: @text; border-bottom-color: @accent; }

QSplitter::handle { background: @ground; }
QSplitter::handle:horizontal:hover { background: @accent_soft; margin: 0 4px; border-radius: 2px; }
QSplitter::handle:vertical:hover { background: @accent_soft; margin: 4px 0; border-radius: 2px; }
QGroupBox { border: 0; margin-top: 18px; }
QGroupBox::title { subcontrol-origin: margin; color: @muted; font-size: 11px; }
"""
