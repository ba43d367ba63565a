// A headless Chromium, and the tests' actions on its pages.

import { execFileSync } from "node:child_process";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const chromiumArguments = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
];

/** Starts Chromium with an empty profile. Call `stop` at the end. */
export async function startBrowser() {
    const profile = await mkdtemp(join(tmpdir(), "ldi-viewer-"));
    const context = await chromium.launchPersistentContext(profile, {
        executablePath: execFileSync("sh", ["-c", "command -v chromium"], { encoding: "utf8" }).trim(),
        headless: true,
        args: chromiumArguments,
    });
    const stop = async () => {
        await context.close();
        await rm(profile, { recursive: true, force: true });
    };
    return { context, stop };
}

/**
 * Opens a file in a new page that records all errors and requests.
 *
 * @param {object} options
 * @param {{width: number, height: number}} [options.size]  of the window
 * @param {boolean} [options.reducedMotion]
 * @param {(string | {path: string})[]} [options.scripts]  run before the page's scripts
 * @param {boolean} [options.isBare]  without buttons, caption and hint, which would cover the photo
 */
export async function openPage(context, file, { size = { width: 320, height: 400 }, reducedMotion = false, scripts = [], isBare = true } = {}) {
    const page = await context.newPage();
    page.setDefaultTimeout(20_000);
    await page.setViewportSize(size);
    await page.emulateMedia({ reducedMotion: reducedMotion ? "reduce" : "no-preference" });
    await page.addInitScript({ content: "window.turns = 0; addEventListener('deviceorientation', () => (window.turns += 1), true);" });
    if (isBare) await page.addInitScript({ content: "localStorage.setItem('photo-3d-hint', 'seen');" });
    for (const script of scripts) await page.addInitScript(typeof script === "string" ? { content: script } : script);
    const address = pathToFileURL(file).href;
    page.errors = [];
    page.on("console", (line) => {
        if (line.type() === "error") page.errors.push(line.text());
    });
    page.on("pageerror", (error) => page.errors.push(error.message));
    page.on("request", (request) => {
        const url = request.url();
        if (url !== address && !url.startsWith("data:") && !url.startsWith("blob:")) page.errors.push(`requested ${url}`);
    });
    page.openingBegan = performance.now();
    await page.goto(address);
    if (isBare) await page.addStyleTag({ content: "photo-3d::part(controls), photo-3d::part(caption) { display: none }" });
    return page;
}

/** Opens a page with a photo and waits until the photo is drawn. */
export async function openPhoto(context, file, options) {
    const page = await openPage(context, file, options);
    await waitUntilDrawn(page);
    page.openingTime = performance.now() - page.openingBegan; // in milliseconds
    return page;
}

export async function waitUntilDrawn(page) {
    await page.waitForFunction(() => {
        const shown = document.querySelector("photo-3d");
        return shown?.complete && shown.shadowRoot.getElementById("message").hidden;
    });
}

export const stateOf = (page) => page.evaluate(() => document.querySelector("photo-3d").state());

/** Waits until the viewer is at rest, and returns its state. */
export function settle(page) {
    return page.evaluate(async () => {
        const nextFrame = () => new Promise(requestAnimationFrame);
        const end = performance.now() + 90_000; // a busy machine draws only few frames
        let still = 0;
        let before = "";
        while (still < 3) {
            await nextFrame();
            if (performance.now() > end) throw new Error(`still moving: ${before}`);
            const now = JSON.stringify(document.querySelector("photo-3d").state());
            still = now === before ? still + 1 : 0;
            before = now;
        }
        return document.querySelector("photo-3d").state();
    });
}

/** Returns a screenshot of the element `selector` as a PNG in base64. */
export async function picture(page, selector = "photo-3d #photo") {
    return (await page.locator(selector).screenshot()).toString("base64");
}

/** Moves a finger through points of the page and leaves it down. Without points, lifts the finger. */
export async function touch(page, points) {
    page.devtools ??= await page.context().newCDPSession(page);
    if (points.length === 0) await page.devtools.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
    for (const [index, point] of points.entries())
        await page.devtools.send("Input.dispatchTouchEvent", { type: index === 0 ? "touchStart" : "touchMove", touchPoints: [point] });
}

/** Rotates the emulated device. Angles are in degrees, as in a DeviceOrientationEvent. */
export async function turnDevice(page, alpha, beta, gamma) {
    page.devtools ??= await page.context().newCDPSession(page);
    const before = await page.evaluate(() => window.turns);
    await page.devtools.send("DeviceOrientation.setDeviceOrientationOverride", { alpha, beta, gamma });
    await page.waitForFunction((before) => window.turns > before, before);
}
