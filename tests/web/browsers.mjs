// Headless Chromium and Firefox, and the actions of tests and benchmarks on the page of examples/web.

import { execFileSync } from "node:child_process";
import puppeteer from "puppeteer-core";

const pathOf = (name) => execFileSync("sh", ["-c", `command -v ${name}`], { encoding: "utf8" }).trim();

/** Starts a browser with an empty profile. Firefox has WebGL only on a screen, such as that of xvfb-run. @param {"chromium" | "firefox"} kind */
export function startBrowser(kind) {
    if (kind === "firefox") {
        const extraPrefsFirefox = {
            "gfx.webrender.software": true, // leaves only WebGL to Mesa, which is slow without a graphics card
            "remote.events.async.mouse.enabled": false, // else a click never ends if Firefox, on a busy machine, loses one of its events
        };
        return puppeteer.launch({ browser: "firefox", executablePath: pathOf("firefox-esr"), headless: !process.env.DISPLAY, extraPrefsFirefox });
    }
    const args = ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"];
    const software = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
    return puppeteer.launch({ executablePath: pathOf("chromium"), headless: true, args: [...args, ...software] });
}

/**
 * Opens the page, and records all errors and requests.
 *
 * @param {import("puppeteer-core").Browser} browser
 * @param {string} address
 * @param {{width?: number, height?: number, isPhone?: boolean, features?: {name: string, value: string}[], first?: () => void}} [options]
 * first  runs in the page and in its frames before their own scripts
 */
export async function openPage(browser, address, { width = 900, height = 800, isPhone = false, features = [], first } = {}) {
    const page = await browser.newPage();
    page.setDefaultTimeout(60_000);
    await page.setViewport({ width, height, isMobile: isPhone, hasTouch: isPhone });
    if (features.length > 0) await page.emulateMediaFeatures(features);
    if (first) await page.evaluateOnNewDocument(first);
    page.errors = [];
    page.requests = [];
    page.on("console", (line) => {
        if (line.type() === "error") page.errors.push(line.text());
    });
    page.on("pageerror", (error) => page.errors.push(error.message));
    page.on("request", (request) => {
        if (/^(https?|wss?):/.test(request.url())) page.requests.push(request.url());
    });
    await page.goto(address);
    await page.evaluate(() => window.photo3d.converter.ready);
    return page;
}

/** Waits for the end of a running conversion. Returns the 3D photo without its bytes, or the page's message. */
export async function waitForResult(page) {
    await page.waitForFunction(() => document.documentElement.dataset.view !== "busy" && (!document.getElementById("error").hidden || document.getElementById("status").textContent !== ""));
    return page.evaluate(() => {
        const error = document.getElementById("error").textContent;
        if (error) return { error };
        const { glb, poster, ...facts } = window.photo3d.shown().photo;
        return { ...facts, glbBytes: glb.length, posterBytes: poster.length, status: document.getElementById("status").textContent };
    });
}

/** Chooses a file like a user, and waits for its 3D photo or a message. */
export async function choose(page, path) {
    const input = await page.$("#file");
    await page.evaluate(() => (document.getElementById("status").textContent = "")); // status of the previous photo
    await input.uploadFile(path);
    return waitForResult(page);
}

/** Converts a file without the page's interface. @returns {Promise<{glb: Buffer, milliseconds: number, facts: object}>} */
export async function convert(page, name, bytes, isExact = false) {
    const { glb, ...result } = await page.evaluate(
        async (name, content, isExact) => {
            const bytes = Uint8Array.from(atob(content), (c) => c.charCodeAt(0));
            const start = performance.now();
            const { glb, poster, ...facts } = await window.photo3d.converter.convert(bytes, name, () => {}, isExact);
            const milliseconds = performance.now() - start;
            let text = "";
            for (let i = 0; i < glb.length; i += 32768) text += String.fromCharCode(...glb.subarray(i, i + 32768));
            return { milliseconds, facts, posterBytes: poster.length, glb: btoa(text) };
        },
        name,
        Buffer.from(bytes).toString("base64"),
        isExact,
    );
    return { ...result, glb: Buffer.from(glb, "base64") };
}
