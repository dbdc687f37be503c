"""The picture of the page in the README: python tests/support/fmu/app_picture.py docs/app.png"""

import json
import sys
import threading

from browser import Browser
from PIL import Image

from ballscrew_fmu.app.page import app_of

STATE = {
    "sizes": {"diameter_mm": "32", "lead_mm": "10", "turns": "4", "rating_n": "32520"},
    "point": {"preload_n": "1600", "speed_rpm": "1206", "temperature_c": "30"},
    "changes": {
        "guide.seal_resistance_N": "8 to 12", "axis.moved_mass_kg": "200", "motor.friction_torque_Nm": "0.15",
        "support_bearings.bore_mm": "25", "support_bearings.outer_diameter_mm": "62",
        "support_bearings.dynamic_rating_N": "28500", "support_bearings.axial_stiffness_N_um": "1000",
    },
}  # fmt: skip


def main(file):
    """Write the picture."""
    server, browser = app_of(), Browser()
    threading.Thread(target=server.serve_forever, daemon=True).start()
    page = browser.open(server.address, 1360, 1000)
    page.until("document.body.dataset.ready === 'yes'")
    page.evaluate(f"packed({json.dumps(json.dumps(STATE))}).then((text) => {{ location.hash = text; }})")
    page.until("!element('axis').hidden && !element('live').hidden && !job")
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")
    page.picture(file)
    Image.open(file).convert("RGB").quantize(64).save(file, optimize=True)
    browser.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
