"""A picture of the studio's page, from a browser without a window.

python docs/_pictures/studio.py docs/images/studio.png
"""

import shutil
import sys
import time
from dataclasses import replace

from playwright.sync_api import sync_playwright

from jet_gym.studio.inputs import Inputs
from jet_gym.studio.server import Studio

GRAPHICS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # by the processor

chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
inputs = replace(Inputs.of_motion("forward"), rival="ga")
with Studio(port=0, inputs=inputs) as studio, sync_playwright() as driver:
    browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox", *GRAPHICS])
    page = browser.new_page(viewport={"width": 1366, "height": 768})
    page.set_default_timeout(180_000)
    page.goto(studio.url)
    page.get_by_text("every constraint holds").wait_for()
    page.get_by_role("tab", name="Planner", exact=True).click()
    page.locator("td", has_text="GA").nth(1).wait_for()
    time.sleep(15.0)  # meshes, plots and shadows come in by and by
    for notice in page.locator(".mantine-Notification-closeButton").all():
        notice.click()
    time.sleep(2.0)
    page.screenshot(path=sys.argv[1], timeout=180_000)
    browser.close()
print(f"wrote {sys.argv[1]}")
