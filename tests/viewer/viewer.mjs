// node viewer.mjs [WORD]: tests the viewer in Chromium with the output of `examples/photo3d/run.sh sample`. Ends with "N passed, N failed".

import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { readFile, stat } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { openPage, openPhoto, picture, settle, startBrowser, stateOf, touch, turnDevice, waitUntilDrawn } from "./browser.mjs";
import { clearColorScript, countGaps, goTo, places } from "./gaps.mjs";
import { besideMiddle, putTogether, square, takeApart, withHoles, withoutCamera } from "./glb.mjs";
import { PageTests } from "./page_tests.mjs";
import { PictureDesk } from "./pictures.mjs";
import { makeUsdPage } from "./usd.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const top = join(here, "../..");
const samplePage = join(top, "out/sample.html");
const emptyPage = join(top, "build/viewer/viewer.html");
const glb = await readFile(join(top, "out/sample.glb"));
const croppedPage = join(top, "out/sample_cropped.html");
const croppedGlb = await readFile(join(top, "out/sample_cropped.glb"));
const axe = await readFile(join(here, "node_modules/axe-core/axe.min.js"), "utf8");
const photo = await readFile(join(top, "examples/photo3d/sample.jpg"), "base64");
const depth = await readFile(join(top, "examples/photo3d/sample_depth.png"), "base64");

const headsetScripts = [
    { path: join(here, "node_modules/iwer/build/iwer.min.js") },
    "window.emulated = new IWER.XRDevice(IWER.metaQuest3, { stereoEnabled: true });" +
        "emulated.installRuntime({ polyfillLayers: true, forceInstall: true });",
];
// A headset that tracks only rotation.
const rotationOnlyScripts = [...headsetScripts, "Object.defineProperty(XRPose.prototype, 'emulatedPosition', { get: () => true });"];

const usdPage = await makeUsdPage(join(top, "out/usd.html"));
const { context, stop } = await startBrowser();
const desk = await PictureDesk.open(context);
const tests = new PageTests(process.argv[2]);
const test = (fact, open, check) => tests.run(fact, open, check);

const opened = (options) => () => openPhoto(context, samplePage, options);
const still = { reducedMotion: true };
const countable = { scripts: [clearColorScript] };

/** Share of the photo's width and height that the frame hides at each border. */
const hiddenBorder = (page) => page.evaluate(() => (document.querySelector("photo-3d").shadowRoot.querySelector(".cropped") ? 0.034 : 0));

/** Presses a button of the element by script, because the tests hide the buttons. */
const press = (page, id) => page.evaluate((id) => document.querySelector("photo-3d").shadowRoot.getElementById(id).click(), id);

/** Returns the frame's center and size in pixels of the window. */
async function frameOf(page) {
    const { x, y, width, height } = await page.locator("photo-3d #photo").boundingBox();
    return { x: x + width / 2, y: y + height / 2, width, height };
}

/** Moves the mouse to (right, up) in the frame, each -1 to 1, and waits until the viewer arrives. */
async function hover(page, right, up) {
    const { x, y, width, height } = await frameOf(page);
    await page.mouse.move(x + (right * width) / 2, y - (up * height) / 2);
    return settle(page);
}

function assertNear(actual, expected, tolerance, what) {
    assert.ok(Math.abs(actual - expected) <= tolerance, `${what}: expected ${expected} within ${tolerance}, found ${actual}`);
}

/** Checks that since the picture `before`, near surfaces have moved opposite to the viewer, relative to far ones. */
async function assertParallax(page, before, { right, up }) {
    const { near, far } = await desk.parallax(before, await picture(page), depth, await hiddenBorder(page));
    const motion = JSON.stringify({ near, far });
    if (right !== 0) assert.ok((near.right - far.right) * Math.sign(right) < -2, `near surfaces move against the viewer, sideways: ${motion}`);
    if (up !== 0) assert.ok((near.down - far.down) * Math.sign(up) > 2, `near surfaces move against the viewer, up and down: ${motion}`);
}

/** Checks that the mesh leaves almost no gaps in the frame, and that the backdrop closes all of them. */
async function assertNextToNoGaps(page) {
    const { width, height } = await frameOf(page);
    const share = (await countGaps(page, false)) / (width * height);
    assert.ok(share < 0.0005, `${100 * share} % uncovered`);
    assert.equal(await countGaps(page, true), 0);
}

/** Checks that no pixel shows the clear color at any position. Prints the largest number of such pixels without the backdrop. */
async function assertNoGaps(page, where = places) {
    let largest = 0;
    for (const place of where) {
        await goTo(page, place);
        largest = Math.max(largest, await countGaps(page, false));
        assert.equal(await countGaps(page, true), 0, JSON.stringify(place));
    }
    console.log(`        at most ${largest} gap pixels without the backdrop`);
    return largest;
}

/** Drops a file on the page. */
async function drop(page, name, bytes) {
    const transfer = await page.evaluateHandle(
        ([name, base64]) => {
            const data = new DataTransfer();
            data.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
            return data;
        },
        [name, Buffer.from(bytes).toString("base64")],
    );
    await page.dispatchEvent("body", "drop", { dataTransfer: transfer });
}
const empty = (options) => async () => {
    const page = await openPage(context, emptyPage, options);
    await page.waitForFunction(() => !document.getElementById("empty").hidden);
    return page;
};

// The first picture

await test("the first picture is the photo", opened({ ...still, size: { width: 1280, height: 800 } }), async (page) => {
    const psnr = await desk.psnr(await picture(page), photo, await hiddenBorder(page));
    console.log(`        ${psnr.toFixed(1)} dB inside the frame, ${Math.round(page.openingTime)} ms after opening`);
    assert.ok(psnr > 28, `${psnr} dB`);
});

await test("the first picture is the photo on a phone's screen", opened({ ...still, size: { width: 390, height: 844 } }), async (page) => {
    const all = await frameOf(page);
    assert.deepEqual([all.width, all.height], [390, 844], "the photo covers an upright screen");
    await press(page, "fit");
    await settle(page);
    const psnr = await desk.psnr(await picture(page), photo);
    assert.ok(psnr > 28, `${psnr} dB`);
    const { width } = await frameOf(page);
    assert.equal(width, 390);
    await press(page, "fit");
    assert.equal((await frameOf(page)).height, 844);
});

await test("on an upright screen, the photo's center of interest is visible", empty({ ...still, size: { width: 390, height: 844 } }), async (page) => {
    const whiteShare = async () => {
        await settle(page);
        return desk.shareOf(await picture(page), [255, 255, 255]);
    };
    await drop(page, "beside.glb", besideMiddle());
    await waitUntilDrawn(page);
    const ofWhole = (0.2 * 1.6) / 4 / (1 - 2 * (await hiddenBorder(page))) ** 2; // the white sheet's share of the frame
    const assertInSight = async (what) => assertNear(await whiteShare(), ofWhole * (2 / (390 / 844)), 0.02, what);
    await assertInSight("at first");
    await page.mouse.wheel(0, -400);
    await page.keyboard.press("Home");
    await assertInSight("after a magnification");
    await press(page, "fit");
    assertNear(await whiteShare(), ofWhole, 0.01, "the whole photo");
    await press(page, "fit");
    await assertInSight("filled again");
    await page.setViewportSize({ width: 844, height: 390 });
    assertNear(await whiteShare(), ofWhole, 0.01, "share of the sheet on a landscape screen");
    await page.setViewportSize({ width: 390, height: 844 });
    await assertInSight("after the phone has been turned");
});

await test("the page's title is the photo's name, and the page is at most 1 MB larger than the GLB in base64", opened(still), async (page) => {
    assert.equal(await page.title(), "sample");
    const { size } = await stat(samplePage);
    const more = size - Math.ceil(glb.length / 3) * 4;
    console.log(`        ${size} bytes, ${more} more than the GLB in base64`);
    assert.ok(more > 0 && more <= 1_000_000);
});

for (const [name, file] of Object.entries({ "of --html": samplePage, "of --html --embed": join(top, "out/embed/sample.html"), "without a photo": emptyPage }))
    await test(`axe reports no violation in the page ${name}`, () => openPage(context, file, { isBare: false, size: { width: 390, height: 844 } }), async (page) => {
        if (file === emptyPage) await page.locator("#empty").waitFor();
        else await waitUntilDrawn(page);
        const assertNone = async (what) => {
            await page.evaluate(axe);
            const { violations, passes } = await page.evaluate(() => window.axe.run());
            assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`), [], what);
            assert.ok(passes.length > 5);
        };
        await assertNone("the page");
        if (!/embed/.test(file)) return;
        await page.locator("#embed").click();
        await assertNone("the lines to copy");
    });

await test("the page cannot send network requests", opened(still), async (page) => {
    const directive = await page.evaluate(async () => {
        const refused = new Promise((resolve) => addEventListener("securitypolicyviolation", resolve, { once: true }));
        await fetch("http://127.0.0.1:9/").catch(() => {});
        return (await refused).effectiveDirective;
    });
    assert.equal(directive, "connect-src");
    page.errors.length = 0; // the console reports the refusal
});

// Motion

await test("an idle viewer sways around the photo's viewpoint until the first input", opened(), async (page) => {
    const { reach } = await stateOf(page);
    await page.waitForFunction((before) => document.querySelector("photo-3d").state().reach.right !== before, reach.right);
    const { isSwaying } = await hover(page, 0.5, 0); // waits until nothing moves
    assert.equal(isSwaying, false);
});

await test("after its last cycle, the sway ends at the photo's viewpoint, and nothing more is drawn", opened(), async (page) => {
    await page.evaluate(() => {
        const shown = document.querySelector("photo-3d");
        shown.setAttribute("sway", "0.2");
        shown.sway();
    });
    const { reach, isSwaying } = await settle(page);
    assert.equal(isSwaying, false);
    for (const axis of ["right", "up"]) assertNear(reach[axis], 0, 1e-6, axis);
    const drawings = () => page.evaluate(() => document.querySelector("photo-3d").constructor.statistics().drawings);
    const before = await drawings();
    await page.waitForTimeout(300);
    assert.equal(await drawings(), before);
});

await test("when the mouse leaves, the viewer returns to rest", opened(), async (page) => {
    const { reach } = await hover(page, 0.9, 0.3);
    assertNear(reach.right, 0.9, 0.01, "right");
    await page.evaluate(() => document.querySelector("photo-3d").shadowRoot.getElementById("box").dispatchEvent(new PointerEvent("pointerleave", { pointerType: "mouse" })));
    assert.deepEqual((await settle(page)).reach, { right: 0, up: 0, forward: 0 });
});

await test("moving the mouse moves the viewpoint, and near surfaces move in the opposite direction", opened(), async (page) => {
    const middle = await hover(page, 0, 0);
    assertNear(middle.reach.right, 0, 0.01, "right");
    const before = await picture(page);
    const right = await hover(page, 0.95, 0);
    assertNear(right.reach.right, 0.95, 0.01, "right");
    await assertParallax(page, before, { right: 1, up: 0 });
    const left = await hover(page, -0.95, 0);
    assertNear(left.reach.right, -0.95, 0.01, "right");
    await assertParallax(page, before, { right: -1, up: 0 });
    const up = await hover(page, 0, 0.95);
    assertNear(up.reach.up, 0.95, 0.01, "up");
    await assertParallax(page, before, { right: 0, up: 1 });
    await hover(page, 0, 0);
    assert.ok((await desk.psnr(await picture(page), before)) > 50, "back in the middle, the picture is the same");
});

await test("at the limits, the frame shows almost no gaps", opened(countable), async (page) => {
    for (const [right, up] of [[1, 1], [-1, 0.2], [0.2, -1], [-1, 1]]) {
        const { reach, angles, visibility } = await hover(page, 0.99 * right, 0.99 * up);
        assertNear(Math.hypot(reach.right, reach.up), 1, 0.001, "the distance from the middle");
        assert.equal(visibility, 1);
        assert.ok(Math.max(Math.abs(angles.horizontal), Math.abs(angles.vertical)) < 10, JSON.stringify(angles));
        await assertNextToNoGaps(page);
    }
});

let drops = 0;

/** Drops a file with another motion, under a new name, so that the page's title shows when it is loaded. */
async function dropWith(page, file, motion) {
    const { json, binary } = takeApart(file);
    const name = `drop ${(drops += 1)}, motion of ${motion}`;
    const scene = { ...json.scenes[0], extras: { ...json.scenes[0].extras, motion } };
    await drop(page, `${name}.glb`, putTogether({ json: { ...json, scenes: [scene] }, binary }));
    await page.waitForFunction((title) => document.title === title, name);
    await waitUntilDrawn(page);
    return json;
}

await test("a page shows the whole photo, and the file's motion limits the viewer sideways and into the scene", empty({ ...still, ...countable }), async (page) => {
    await dropWith(page, glb, 0.08);
    assert.equal(await hiddenBorder(page), 0);
    const psnr = await desk.psnr(await picture(page), photo);
    assert.ok(psnr > 28, `the whole photo is in sight: ${psnr} dB`);
    for (const motion of [0.08, 0.02]) {
        await dropWith(page, glb, motion);
        for (const place of [{ right: 1, up: 0 }, { right: -1, up: 0 }, { right: 0, up: 1 }, { right: 0, up: -1 }, { right: 0.7072, up: 0.7072 }]) {
            assertNear((await goTo(page, place)).motion, motion, 1e-3, JSON.stringify(place));
            await assertNextToNoGaps(page);
        }
        for (const forward of [1, -1]) {
            assertNear((await goTo(page, { right: 1, up: 0, forward })).motion, motion, 1e-3, `forward ${forward}`);
            await assertNextToNoGaps(page);
        }
    }
});

await test("if surfaces end at the photo's border, the page hides the border, which limits the sideways motion", empty(still), async (page) => {
    await dropWith(page, glb, 0.05);
    assert.equal(await hiddenBorder(page), 0);
    for (const motion of [0.08, 0.02]) {
        const json = await dropWith(page, croppedGlb, motion);
        const { aspectRatio } = json.cameras[0].perspective;
        const hidden = 1.5 * (await hiddenBorder(page)) * Math.min(aspectRatio, 1 / aspectRatio);
        assertNear(1.5 * (await hiddenBorder(page)), 0.051, 1e-6, "as README.md and --help say");
        assertNear((await goTo(page, { right: 1, up: 0 })).motion, Math.min(hidden, motion), 1e-3, "sideways");
        assertNear((await goTo(page, { right: 0, up: 1 })).motion, Math.min(hidden, motion), 1e-3, "up");
        assertNear((await goTo(page, { right: 1, up: 0, forward: 1 })).motion, motion, 1e-3, "forward");
    }
});

await test("scrolling up zooms in at the mouse pointer; a double-click and the button reset the zoom", opened(countable), async (page) => {
    const { x, y, width, height } = await frameOf(page);
    await hover(page, 0.5, 0.5);
    const before = await picture(page);
    await page.mouse.wheel(0, -400);
    const near = await settle(page);
    assertNear(near.zoom, 2, 1e-3, "zoom");
    assertNear(near.reach.forward, 1, 1e-6, "forward");
    await assertNextToNoGaps(page);
    await page.mouse.wheel(0, -100_000);
    assertNear((await settle(page)).zoom, 6, 1e-3, "zoom");
    await page.mouse.wheel(0, 100_000);
    const far = await settle(page);
    assertNear(far.zoom, 1, 1e-3, "zoom");
    assertNear(far.reach.forward, 0, 1e-6, "forward");
    assert.ok((await desk.psnr(await picture(page), before)) > 50, "as before");
    await page.mouse.dblclick(x + width / 4, y - height / 4);
    assertNear((await settle(page)).zoom, 2.5, 1e-3, "zoom");
    await press(page, "reset");
    assertNear((await settle(page)).zoom, 1, 1e-3, "zoom");
    await page.mouse.dblclick(x, y);
    await page.mouse.dblclick(x, y);
    assertNear((await settle(page)).zoom, 1, 1e-3, "zoom");
});

await test("two fingers magnify and pan; a double tap resets the magnification", opened(still), async (page) => {
    const { x, y, width } = await frameOf(page);
    page.devtools ??= await page.context().newCDPSession(page);
    const fingers = (type, ...touchPoints) => page.devtools.send("Input.dispatchTouchEvent", { type, touchPoints });
    await fingers("touchStart", { x: x - 20, y, id: 0 }, { x: x + 20, y, id: 1 });
    for (const apart of [30, 40, 50, 60]) await fingers("touchMove", { x: x - apart, y, id: 0 }, { x: x + apart, y, id: 1 });
    await fingers("touchEnd");
    assertNear((await settle(page)).zoom, 3, 0.1, "zoom");
    const before = await picture(page);
    await touch(page, [{ x, y }, { x: x + 0.3 * width, y }]);
    await touch(page, []);
    assert.ok((await desk.psnr(await picture(page), before)) < 30, "the picture has moved");
    for (let i = 0; i < 2; ++i) {
        await touch(page, [{ x, y }]);
        await touch(page, []);
    }
    assertNear((await settle(page)).zoom, 1, 1e-3, "zoom");
});

await test("f and a button enter and leave full screen", opened(), async (page) => {
    const isFull = () => page.evaluate(() => document.fullscreenElement?.localName ?? "");
    await page.keyboard.press("f");
    await page.waitForFunction(() => document.fullscreenElement);
    assert.equal(await isFull(), "photo-3d");
    await page.keyboard.press("f");
    await page.waitForFunction(() => !document.fullscreenElement);
});

await test("in full screen, the buttons fade, even after a click, and a tap on an invisible button only reveals it", opened({ isBare: false }), async (page) => {
    const look = () =>
        page.evaluate(() => {
            const { opacity, pointerEvents } = getComputedStyle(document.querySelector("photo-3d").shadowRoot.getElementById("controls"));
            return [opacity, pointerEvents].join();
        });
    const waitForLook = async (expected) => {
        for (const end = performance.now() + 15_000; (await look()) !== expected; ) {
            assert.ok(performance.now() < end, `expected ${expected}, found ${await look()}`);
            await page.waitForTimeout(100);
        }
    };
    const button = page.locator("photo-3d #fullscreen");
    await page.mouse.move(100, 100); // reveals the buttons
    await button.click();
    await page.waitForFunction(() => document.fullscreenElement);
    await page.mouse.move(100, 100);
    await waitForLook("0,none");
    const { x, y, width, height } = await button.boundingBox();
    await touch(page, [{ x: x + width / 2, y: y + height / 2 }]);
    await touch(page, []);
    await waitForLook("1,auto");
    await waitForLook("0,none");
    assert.ok(await page.evaluate(() => document.fullscreenElement !== null), "the tap presses no button");
    await page.keyboard.press("Tab");
    for (let i = 0; i < 8 && (await page.evaluate(() => document.activeElement.shadowRoot?.activeElement?.localName)) !== "button"; ++i) await page.keyboard.press("Tab");
    await waitForLook("1,auto");
    await page.waitForTimeout(3500);
    assert.equal(await look(), "1,auto", "a button with the keyboard's focus stays visible");
    await page.evaluate(() => document.exitFullscreen());
});

await test("a hint, which appears only once, explains how to look around, beside the photo if there is space", opened({ isBare: false, size: { width: 844, height: 390 } }), async (page) => {
    await page.evaluate(() => localStorage.clear());
    await page.reload();
    await waitUntilDrawn(page);
    const hint = page.locator("photo-3d #hint");
    await hint.waitFor();
    assert.match(await hint.innerText(), /look around/);
    const [text, shown] = [await hint.boundingBox(), await page.locator("photo-3d #photo").boundingBox()];
    assert.ok(text.x + text.width <= shown.x, "the hint is beside the photo");
    await page.mouse.move(400, 200);
    assert.ok(await hint.isHidden());
    await page.reload();
    await waitUntilDrawn(page);
    assert.ok(await hint.isHidden());
});

await test("keys look around, move in and out, and reset the view", opened(still), async (page) => {
    const before = await picture(page);
    for (let i = 0; i < 20; ++i) await page.keyboard.press("ArrowRight");
    let { reach, visibility } = await settle(page);
    assertNear(reach.right, 1, 1e-6, "right");
    assert.equal(visibility, 1);
    await assertParallax(page, before, { right: 1, up: 0 });
    await page.keyboard.press("Home");
    for (let i = 0; i < 20; ++i) await page.keyboard.press("ArrowDown");
    ({ reach } = await settle(page));
    assertNear(reach.up, -1, 1e-6, "up");
    await page.keyboard.press("+");
    ({ reach } = await settle(page));
    assert.ok(reach.forward > 0.1);
    await page.keyboard.press("Home");
    ({ reach } = await settle(page));
    assert.deepEqual(reach, { right: 0, up: 0, forward: 0 });
    assert.ok((await desk.psnr(await picture(page), before)) > 50);
});

await test("a finger drags the scene within the limits; when it lifts, the viewer returns to rest", opened(), async (page) => {
    const { x, y, width } = await frameOf(page);
    await touch(page, [{ x, y }]);
    const start = await settle(page); // the sway has ended
    const before = await picture(page);
    await touch(page, [{ x, y }, { x: x + 0.2 * width, y }]);
    const dragged = await settle(page);
    assertNear(dragged.reach.right - start.reach.right, -0.5, 0.05, "right");
    await assertParallax(page, before, { right: -1, up: 0 });
    await touch(page, []);
    await settle(page);
    await touch(page, [{ x: x - 0.49 * width, y }, { x: x + 0.49 * width, y }]); // crosses the frame more than once
    const far = await settle(page);
    assertNear(far.reach.right, -1, 1e-3, "right");
    assert.ok(Math.abs((await desk.brightness(await picture(page))) / (await desk.brightness(before)) - 1) < 0.1, "nothing is dimmed");
    await touch(page, []);
    assert.deepEqual((await settle(page)).reach, { right: 0, up: 0, forward: 0 });
});

// Stops the clock, so that the neutral orientation does not adapt on slow machines.
const timeless = "Object.defineProperty(Event.prototype, 'timeStamp', { get: () => 0 });";

await test("when the device is turned, the viewpoint moves toward the edge of the device that comes nearer", opened({ scripts: [timeless] }), async (page) => {
    await hover(page, 0, 0);
    await turnDevice(page, 0, 60, 0);
    await settle(page);
    const before = await picture(page);
    await turnDevice(page, 0, 72, 0); // tilts the upper edge toward the head, for a view from above
    const above = await settle(page);
    assertNear(above.reach.up, 12 / 20, 0.05, "up");
    assertNear(above.reach.right, 0, 0.05, "right");
    await assertParallax(page, before, { right: 0, up: 1 });
    await turnDevice(page, 0, 60, 12); // turns the right edge away from the head, for a view from the left
    const left = await settle(page);
    assertNear(left.reach.right, -12 / 20, 0.08, "right");
    await assertParallax(page, before, { right: -1, up: 0 });
    await turnDevice(page, 0, 60, 80);
    const end = await settle(page);
    assertNear(Math.hypot(end.reach.right, end.reach.up), 1, 1e-3, "distance of the viewpoint from the center");
    assert.equal(end.visibility, 1);
});

// Like iOS, sends no orientation events before the user permits them, and allows the request only during a tap. The user's response is
// `window.answer`.
const askingScript = `
    Object.defineProperty(navigator, "maxTouchPoints", { get: () => 5 });
    addEventListener("deviceorientation", (event) => window.isAllowed || event.stopImmediatePropagation(), true);
    addEventListener("click", (event) => (window.isHandlingTap = event.isTrusted), true);
    addEventListener("click", () => (window.isHandlingTap = false));
    window.requests = 0;
    DeviceOrientationEvent.requestPermission = async () => {
        window.requests += 1;
        if (!window.isHandlingTap) throw new DOMException("Requesting device orientation access requires a user gesture to prompt", "NotAllowedError");
        window.isAllowed = window.answer === "granted";
        return window.answer;
    };`;
for (const answer of ["granted", "denied"])
    await test(`if tilting needs permission, a tap on a button requests it: ${answer}`, opened({ isBare: false, scripts: [askingScript, timeless, `window.answer = "${answer}"`] }), async (page) => {
        const button = page.locator("photo-3d #tilt");
        const look = async (turn) => {
            await touch(page, [await frameOf(page)]); // ends the sway
            await touch(page, []);
            await turnDevice(page, 0, 60, 0);
            await turnDevice(page, 0, 60, turn);
            return (await settle(page)).reach.right;
        };
        const reveal = async () => {
            const { x, y } = await button.boundingBox();
            await page.mouse.move(x, y);
        };
        assert.ok(await button.isVisible());
        assertNear(await look(12), 0, 0.01, "right");
        assert.equal(await page.evaluate(() => window.requests), 0, "the page requests no permission by itself");
        await reveal(); // a slow machine may have hidden the buttons
        await button.click();
        assert.equal(await page.evaluate(() => window.requests), 1);
        assert.ok(await button.isHidden());
        const right = await look(-12);
        if (answer === "granted") assert.ok(right > 0.4, String(right));
        else assertNear(right, 0, 0.01, "right");
    });

await test("with reduced motion, only dragging and keys move the photo", opened(still), async (page) => {
    const before = await picture(page);
    await page.waitForTimeout(500);
    assert.deepEqual((await hover(page, 0.9, 0.9)).reach, { right: 0, up: 0, forward: 0 });
    assert.equal(await picture(page), before);
    await page.mouse.down();
    const { x, y, width } = await frameOf(page);
    await page.mouse.move(x + 0.45 * width - 0.2 * width, y - 0.45 * (await frameOf(page)).height);
    assertNear((await settle(page)).reach.right, 0.5, 0.05, "right");
    await page.mouse.up();
});

// The backdrop

const seenStill = { ...still, ...countable };
for (const name of ["sample", "sample_compressed", "sample_full"])
    await test(`no gap in ${name}.html shows the clear color`, () => openPhoto(context, join(top, `out/${name}.html`), seenStill), (page) => assertNoGaps(page));

await test("a page with the paper's cropped frame has no gap, and shows the photo without its border", () => openPhoto(context, croppedPage, seenStill), async (page) => {
    assertNear(await hiddenBorder(page), 0.034, 1e-6, "the hidden border");
    assert.ok((await desk.psnr(await picture(page), photo, await hiddenBorder(page))) > 28);
    await assertNoGaps(page);
});

for (const name of ["kodim01", "kodim03", "kodim05"]) {
    const file = join(top, `out/gaps/${name}.html`);
    if (!existsSync(file)) console.log(`skipped: the photograph ${name}: ../shared/photos/eval is absent`);
    else await test(`no gap in the photograph ${name} shows the clear color`, () => openPhoto(context, file, seenStill), (page) => assertNoGaps(page));
}

const contextScript = `
    window.contexts = [];
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
        const context = getContext.call(this, kind, ...rest);
        if (kind === "webgl2" && context) window.contexts.push(context);
        return context;
    };`;
await test("the photo reappears after the graphics card loses all data", () => openPhoto(context, croppedPage, { ...still, scripts: [contextScript, clearColorScript] }), async (page) => {
    await goTo(page, { right: -1, up: 0 });
    const before = await picture(page);
    await page.evaluate(() => window.contexts[0].getExtension("WEBGL_lose_context").loseContext());
    assert.ok((await desk.psnr(await picture(page), before)) > 50, "meanwhile, the last picture stays");
    await page.waitForFunction(() => window.contexts.length === 2);
    await goTo(page, { right: 1, up: 0 });
    assert.ok((await desk.psnr(await picture(page), before)) < 40, "the picture changes with the viewpoint");
    assert.equal(await countGaps(page, true), 0);
    await goTo(page, { right: -1, up: 0 });
    assert.ok((await desk.psnr(await picture(page), before)) > 50);
});

// Headsets

/** Presses the button and waits for a picture from the headset. */
async function enterHeadset(page) {
    await press(page, "headset");
    await page.waitForFunction(() => document.querySelector("photo-3d").state().eyes.length === 2 && document.querySelector("photo-3d").state().eyes[0][0] !== 0);
    return settle(page);
}
const betweenEyes = ({ eyes: [left, right] }) => left.map((value, axis) => (value + right[axis]) / 2);
const moveHead = async (page, change) => {
    await page.evaluate(change);
    return settle(page);
};

await test("a headset shows two views, and head motion moves the viewer by the same distance", opened({ scripts: headsetScripts }), async (page) => {
    await hover(page, 0, 0);
    const flat = await picture(page);
    const home = await enterHeadset(page);
    const [left, right] = home.eyes;
    const apart = await page.evaluate(() => window.emulated.ipd);
    assertNear(right[0] - left[0], apart, 1e-4, "distance of the eyes");
    betweenEyes(home).forEach((value) => assertNear(value, 0, 0.02, "where the photo was taken"));
    const canvas = await picture(page, "canvas >> nth=0");
    const halves = [await desk.half(canvas, "left"), await desk.half(canvas, "right")];
    for (const half of halves) assert.ok((await desk.brightness(half)) > 10, "the pictures of both eyes are not black");
    const alike = await desk.psnr(halves[0], halves[1]);
    assert.ok(alike < 35, `each eye sees its own picture: ${alike} dB`);

    const moved = await moveHead(page, () => {
        window.emulated.position.x += 0.02;
        window.emulated.position.y += 0.01;
    });
    assertNear(betweenEyes(moved)[0] - betweenEyes(home)[0], 0.02, 1e-3, "meters to the right");
    assertNear(betweenEyes(moved)[1] - betweenEyes(home)[1], 0.01, 1e-3, "meters up");
    assert.equal(moved.visibility, 1);

    const lit = await desk.brightness(await picture(page, "canvas >> nth=0"));
    const far = await moveHead(page, () => (window.emulated.position.x += 5));
    assert.equal(far.visibility, 0);
    assert.ok((await desk.brightness(await picture(page, "canvas >> nth=0"))) < lit);

    await page.evaluate(() => window.emulated.activeSession.end());
    await page.waitForFunction(() => !document.querySelector("photo-3d").state().isInHeadset);
    await hover(page, 0, 0);
    assert.ok((await desk.psnr(await picture(page), flat)) > 40, "back on the screen");
});

await test("without a photo, the headset button shows a message and starts no session", empty({ ...still, scripts: headsetScripts }), async (page) => {
    const asked = await page.evaluate(async () => {
        let sessions = 0;
        navigator.xr.requestSession = () => (sessions += 1);
        const shown = document.createElement("photo-3d");
        shown.setAttribute("standalone", "");
        document.body.append(shown);
        shown.shadowRoot.getElementById("headset").click();
        return { sessions, message: shown.shadowRoot.getElementById("message").textContent };
    });
    assert.deepEqual(asked, { sessions: 0, message: "There is no photo to view in the headset yet." });
});

await test("a headset session that fails to start ends with a message, and the photo continues to move on the screen", opened({ scripts: headsetScripts }), async (page) => {
    await page.evaluate(() => {
        window.ended = 0;
        const request = navigator.xr.requestSession.bind(navigator.xr);
        navigator.xr.requestSession = async (...rest) => {
            const session = await request(...rest);
            session.addEventListener("end", () => (window.ended += 1));
            session.requestReferenceSpace = () => Promise.reject(new Error("no space"));
            return session;
        };
    });
    await press(page, "headset");
    await page.waitForFunction(() => document.querySelector("photo-3d").shadowRoot.getElementById("message").textContent === "The headset can't be used: no space");
    assert.equal(await page.evaluate(() => window.ended), 1);
    const before = await hover(page, 0, 0);
    const after = await hover(page, 0.8, 0);
    assert.ok(Math.abs(after.reach.right - before.reach.right) > 0.2);
    assert.equal(after.isInHeadset, false);
});

await test("no gap in a headset shows the clear color", opened({ scripts: [...headsetScripts, clearColorScript] }), async (page) => {
    await enterHeadset(page);
    for (const way of [0, 0.02, -0.05]) {
        await moveHead(page, `window.emulated.position.x += ${way}`);
        const without = await countGaps(page, false);
        console.log(`        ${without} gap pixels without the backdrop`);
        assert.equal(await countGaps(page, true), 0);
    }
});

await test("a headset that tracks only rotation uses a neck model", opened({ scripts: rotationOnlyScripts }), async (page) => {
    const home = await enterHeadset(page);
    const still = await moveHead(page, () => (window.emulated.position.x += 0.3));
    assertNear(betweenEyes(still)[0], betweenEyes(home)[0], 1e-3, "the position that such a headset reports is ignored");
    // A turn by 60 degrees to the left moves the eyes 8 cm x sin 60 to the left and 8 cm x (1 - cos 60) back.
    const turned = await moveHead(page, () => window.emulated.quaternion.set(0, Math.sin(Math.PI / 6), 0, Math.cos(Math.PI / 6)));
    const motion = betweenEyes(turned).map((value, axis) => value - betweenEyes(home)[axis]);
    [-0.0693, 0, 0.04].forEach((expected, axis) => assertNear(motion[axis], expected, 2e-3, "meters"));
});

// Files

await test("without a photo, the viewer prompts for one, and it shows a dropped GLB", empty(still), async (page) => {
    assert.match(await page.locator("#empty").innerText(), /Drop a 3D photo/);
    await drop(page, "my photo.glb", glb);
    await waitUntilDrawn(page);
    assert.equal(await page.title(), "my photo");
    assert.ok(await page.locator("#empty").isHidden());
    const psnr = await desk.psnr(await picture(page), photo, await hiddenBorder(page));
    assert.ok(psnr > 28, `${psnr} dB`);
});

await test("a compressed GLB has the same picture and motion limits as the uncompressed one", empty(still), async (page) => {
    const shown = [];
    for (const [name, bytes] of [["plain.glb", glb], ["compressed.glb", await readFile(join(top, "out/sample_compressed.glb"))]]) {
        await drop(page, name, bytes);
        await page.waitForFunction((title) => document.title === title, name.replace(".glb", ""));
        for (let i = 0; i < 20; ++i) await page.keyboard.press("ArrowRight");
        const { angles } = await settle(page);
        shown.push({ picture: await picture(page), angles });
    }
    const [plain, compressed] = shown;
    const psnr = await desk.psnr(compressed.picture, plain.picture);
    console.log(`        ${psnr.toFixed(1)} dB`);
    assert.ok(psnr > 45, `${psnr} dB`);
    assertNear(compressed.angles.horizontal, plain.angles.horizontal, 1e-3, "degrees");
});

await test("a page with a compressed photo, its texture in WebP, shows the photo", () => openPhoto(context, join(top, "out/sample_compressed.html"), still), async (page) => {
    const psnr = await desk.psnr(await picture(page), photo, await hiddenBorder(page));
    console.log(`        ${psnr.toFixed(1)} dB`);
    assert.ok(psnr > 28, `${psnr} dB`);
    assert.ok((await stat(join(top, "out/sample_compressed.html"))).size < (await stat(samplePage)).size - 50_000);
});

await test("a full-size photo on several textures looks like the photo", () => openPhoto(context, join(top, "out/sample_full.html"), still), async (page) => {
    const psnr = await desk.psnr(await picture(page), photo, await hiddenBorder(page));
    console.log(`        ${psnr.toFixed(1)} dB`);
    assert.ok(psnr > 26, `${psnr} dB`); // silhouettes have a third of the resolution
});

for (const name of ["sample", "sample_full"])
    await test(`three.js shows ${name}.usdz as the photo, from the photo's viewpoint`, () => openPage(context, usdPage, still), async (page) => {
        const camera = takeApart(glb).json.cameras[0].perspective;
        await page.evaluate(([usdz, lens]) => showUsdz(usdz, lens), [await readFile(join(top, `out/${name}.usdz`), "base64"), camera]);
        const psnr = await desk.psnr(await picture(page, "canvas"), photo);
        console.log(`        ${psnr.toFixed(1)} dB`);
        assert.ok(psnr > 25, `${psnr} dB`);
    });

await test("users can open a GLB file, even one without a camera", empty(still), async (page) => {
    await page.setInputFiles("#file", { name: "bare.glb", mimeType: "model/gltf-binary", buffer: withoutCamera(croppedGlb) });
    await waitUntilDrawn(page);
    const psnr = await desk.psnr(await picture(page), photo, await hiddenBorder(page));
    assert.ok(psnr > 20, `${psnr} dB`); // the mesh ends within about a pixel of the photo's border
});

await test("the backdrop, a blurred picture of the photo, fills holes in a mesh", empty({ ...seenStill, size: { width: 640, height: 800 } }), async (page) => {
    await drop(page, "holes.glb", withHoles(glb, 40));
    await waitUntilDrawn(page);
    const closed = await desk.psnr(await picture(page), photo, await hiddenBorder(page));
    assert.ok((await assertNoGaps(page, [...places.slice(0, 2), ...places.slice(-1)])) > 1000);
    await countGaps(page, false);
    await page.keyboard.press("Home");
    await settle(page);
    const open = await desk.psnr(await picture(page), photo, await hiddenBorder(page));
    console.log(`        ${closed.toFixed(1)} dB, without the backdrop ${open.toFixed(1)} dB`);
    assert.ok(closed > 24 && closed > open + 5, `${closed} and ${open} dB`);
});

await test("a model that is not a photo is shown from the front", empty(still), async (page) => {
    await drop(page, "square.glb", square());
    await waitUntilDrawn(page);
    const share = await desk.shareOf(await picture(page), [255, 255, 255]);
    assert.ok(share > 0.4 && share < 0.95, `${share} of the picture`);
});

for (const density of [1, 3])
    await test(`edges are antialiased if a CSS pixel has ${density} x ${density} pixels of the screen`, empty(still), async (page) => {
        const devtools = await context.newCDPSession(page);
        await devtools.send("Emulation.setDeviceMetricsOverride", { width: 320, height: 400, deviceScaleFactor: density, mobile: false });
        await drop(page, "square.glb", square(0.15));
        await waitUntilDrawn(page);
        await settle(page);
        const screen = await devtools.send("Page.captureScreenshot", { format: "png" });
        const edge = await desk.leftEdge(screen.data);
        console.log(`        ${edge.width.toFixed(2)} pixels of the screen wide, ${edge.levels} levels`);
        // The edge is about one pixel wide. An enlarged picture would have wider edges, and a picture without antialiasing sharp ones.
        assert.ok(edge.levels >= 3 && edge.width > 0.5 && edge.width < 1.5, JSON.stringify(edge));
    });

await test("a message names a file that can't be shown, and the photo stays", opened(still), async (page) => {
    const before = await picture(page);
    await drop(page, "notes.txt", Buffer.from("hello, this is no model"));
    await page.locator("#message").waitFor();
    assert.match(await page.locator("#message").innerText(), /notes\.txt can't be shown.*not a GLB/);
    await drop(page, "cut.glb", glb.subarray(0, 5000));
    await page.locator("#message", { hasText: "cut.glb can't be shown. The file is incomplete." }).waitFor();
    await page.evaluate(() => document.querySelector("photo-3d").report(""));
    assert.ok((await desk.psnr(await picture(page), before)) > 50);
});

const noWebGl = `
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) { return kind === "2d" ? getContext.call(this, kind, ...rest) : null; };`;
await test("without WebGL, the page shows a message and the flat photo", () => openPage(context, samplePage, { scripts: [noWebGl] }), async (page) => {
    await page.locator("#message").waitFor();
    assert.match(await page.locator("#message").innerText(), /WebGL/);
    await page.evaluate(() => document.querySelector("photo-3d").report(""));
    const psnr = await desk.psnr(await picture(page), photo, await hiddenBorder(page));
    assert.ok(psnr > 25, `${psnr} dB`);
});

await stop();
tests.end();
