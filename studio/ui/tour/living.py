"""Live: the run moves an avatar from the microphone, now."""

from __future__ import annotations

from PySide6.QtWidgets import QLabel, QPushButton

from studio.ui.tour.driver import PATIENCE
from studio.ui.tour.guide import Guide
from studio.ui.tour.listener import Listener

LEAST_FRAMES = 30


def go_live(guide: Guide) -> None:
    """A program that listens for VMC receives the live avatar; the panic key stops it."""
    driver, listener = guide.driver, Listener()
    try:
        guide.show_room("live")
        driver.choose("review_run_live", guide.run_id)
        driver.type_into("live_target_port_0", str(listener.port))
        driver.click("live_start")
        start = driver.find("live_start", QPushButton)
        latency = driver.find("live_latency", QLabel)

        def received() -> bool:
            listener.read()
            return listener.frames >= LEAST_FRAMES and latency.text().endswith("ms")

        driver.wait(received, 2 * PATIENCE, f"{LEAST_FRAMES} live frames arrived at the other program")
        driver.picture("live")
        driver.click("live_neutral")
        status = driver.find("live_status", QLabel)
        driver.wait(lambda: "Neutral" in status.text(), PATIENCE, "the panic key was heeded")
        running = start.text()
        driver.click("live_start")
        driver.wait(lambda: start.text() != running and start.isEnabled(), PATIENCE, "it was no longer live")
    finally:
        listener.close()
