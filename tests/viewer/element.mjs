// node element.mjs [chromium|firefox [WORD]]: tests the element <photo-3d> in other pages, in Chromium and Firefox: a feed of 50 photos,
// hostile files, the gallery of a batch. Needs the output of run.sh. Ends with "N passed, N failed".

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, readFileSync } from "node:fs";
import { mkdir, readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { dirname, extname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import puppeteer, { ProtocolError } from "puppeteer-core";
import { checkGlb } from "../../examples/viewer/source/check_glb.js";
import { besideMiddle, putTogether, square, takeApart } from "./glb.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const top = join(here, "../..");
const pictures = join(top, "out/element");
const moduleFile = join(top, "build/viewer/photo-3d/photo-3d.js");
const axe = await readFile(join(here, "node_modules/axe-core/axe.min.js"), "utf8");
const glb = await readFile(join(top, "out/feed.glb"));
// Real phones have 2 or 3 device pixels per CSS pixel, which take minutes to test without a graphics card. Another test covers them.
const sizes = { desktop: { width: 1280, height: 800 }, phone: { width: 390, height: 844, deviceScaleFactor: 1.5, isMobile: true, hasTouch: true } };
const [onlyBrowser, onlyWord] = process.argv.slice(2);
await mkdir(pictures, { recursive: true });

/** Returns a page with this content. The page shows no hint and records its WebGL contexts. */
const pageAround = (content) => `<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Feed</title><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width, initial-scale=1"><style>body { margin: 0 auto; max-width: 600px } article { padding: 16px }
img, photo-3d { display: block; width: 100% }</style><script>
localStorage.setItem("photo-3d-hint", "seen");
window.contexts = [];
const { getContext } = HTMLCanvasElement.prototype;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    const context = getContext.call(this, kind, ...rest);
    if (kind === "webgl2") window.contexts.push(context);
    return context;
};</script><script type="module" src="/photo-3d.js"></script></head><body><main><h1>Feed</h1>${content}</main></body></html>`;
const feedOf = (item) => pageAround(Array.from({ length: 50 }, (_, i) => `<article><h2>Photo ${i}</h2>${item(i)}</article>`).join(""));
const element = (i) => `<photo-3d src="/feed.glb?${i}" poster="/poster.jpg" width="1152" height="1536" sway="0.1" alt="Toys, ${i}"></photo-3d>`;
const flat = (i) => `<img src="/poster.jpg" width="1152" height="1536" style="height: auto" alt="Toys, ${i}">`;

const hostile = hostileFiles();
const files = {
    "/photo-3d.js": readFileSync(moduleFile),
    "/feed.glb": glb,
    "/square.glb": square(),
    "/poster.jpg": readFileSync(join(top, "out/embed/sample.poster.jpg")),
    "/feed.html": feedOf(element),
    "/flat.html": feedOf(flat),
    "/stuck.html": feedOf((i) => element(i).replace("/feed.glb?0", "/silent.glb")),
    "/embedded.html": pageAround(linesToCopy()),
    "/early.html": pageAround(`<photo-3d></photo-3d><script>
const early = document.querySelector("photo-3d");
Object.assign(early, { src: "/feed.glb", poster: "/poster.jpg", alt: "Toys" });
window.wasDefined = customElements.get("photo-3d") !== undefined;</script>`),
    "/lazy.html": feedOf((i) => element(i).replace('poster="/poster.jpg"', `loading="lazy" poster="/poster.jpg?${i}"`)),
    "/strict.html": `<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Strict</title><script type="module" src="/photo-3d.js">
</script></head><body>${element(0)}</body></html>`,
    "/slotted.html": pageAround('<photo-3d src="/feed.glb"><img slot="poster" src="/poster.jpg" alt=""></photo-3d>'),
    "/one.html": pageAround(`<div id="place" style="width: 300px; background: rgb(0, 255, 0)"></div>`),
    ...Object.fromEntries(Object.entries(hostile).map(([name, bytes]) => [`/${name}.glb`, bytes])),
};
const types = { ".js": "text/javascript", ".glb": "model/gltf-binary", ".jpg": "image/jpeg", ".html": "text/html; charset=utf-8" };
/** The narrowest policy that allows the element, its files, and what the README says. */
const strictPolicy = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self' blob:; img-src 'self' blob:";
const asked = [];
const server = createServer((request, response) => {
    const path = decodeURIComponent(request.url.split("?")[0]);
    asked.push(path);
    if (path === "/silent.glb") return; // never responds
    let body = files[path];
    const folder = path.startsWith("/gallery/") ? "out" : "out/embed"; // files of --gallery and of --embed
    if (body === undefined && existsSync(join(top, folder, path))) body = readFileSync(join(top, folder, path));
    const policy = path === "/strict.html" ? { "content-security-policy": strictPolicy } : {};
    response.writeHead(body === undefined ? 404 : 200, { "content-type": types[extname(path)] ?? "application/octet-stream", ...policy });
    response.end(body);
});
await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
const site = `http://127.0.0.1:${server.address().port}`;

/** Returns the lines that the page of --embed offers to copy. */
function linesToCopy() {
    const [, lines] = /<template id="snippet">([^]*?)<\/template>/.exec(readFileSync(join(top, "out/embed/sample.html"), "utf8"));
    return lines.replaceAll("&lt;", "<").replaceAll("&quot;", '"').replaceAll("&amp;", "&");
}

/** Returns GLB files that need too many resources, or are broken, by name. */
function hostileFiles() {
    const changed = (change) => {
        const { json, binary } = takeApart(glb);
        change(json);
        return putTogether({ json, binary });
    };
    const plain = (change) => {
        const { json, binary } = takeApart(square());
        change(json);
        return putTogether({ json, binary });
    };
    const withCamera = (yfov, aspectRatio) => plain((json) => (json.cameras = [{ type: "perspective", perspective: { yfov, aspectRatio, znear: 0.1 } }]));
    const meshopt = (count) => ({ EXT_meshopt_compression: { count, byteStride: 256 } });
    /** Returns a model with an image, given as characters of one byte each. */
    const withImage = (image, textures = 1, images = 1, texture = { source: 0 }) => {
        const { json, binary } = takeApart(square());
        const file = Buffer.alloc(64);
        file.write(image, "latin1");
        json.bufferViews.push({ buffer: 0, byteOffset: binary.length, byteLength: file.length });
        json.images = Array.from({ length: images }, () => ({ bufferView: json.bufferViews.length - 1, mimeType: "image/png" }));
        json.textures = Array.from({ length: textures }, () => texture);
        json.materials[0].pbrMetallicRoughness = { baseColorTexture: { index: 0 } };
        json.buffers[0].byteLength += file.length;
        return putTogether({ json, binary: Buffer.concat([binary, file]) });
    };
    const png = (side) => "\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + `\0\0${side}`.repeat(2);
    const losslessWebp = "RIFF\0\0\0\0WEBPVP8L\0\0\0\0\x2f\xfe\xbf\xff\x0f"; // 16383 x 16384
    const manyVertices = (json) => (json.accessors[json.meshes[0].primitives[0].attributes.POSITION].count = 1e6);
    return {
        empty: Buffer.alloc(0),
        text: Buffer.from("this is no model at all, only text"),
        cut: glb.subarray(0, 4000),
        secondJson: (() => {
            const secret = putTogether({ json: { asset: { version: "2.0" }, buffers: [{ uri: "/secret.bin", byteLength: 4 }] }, binary: Buffer.alloc(0) });
            const whole = Buffer.concat([square(), secret.subarray(12)]);
            whole.writeUInt32LE(whole.length, 8);
            return whole;
        })(),
        noJson: Buffer.concat([glb.subarray(0, 20), Buffer.from("{{{{"), glb.subarray(24)]),
        elsewhere: plain((json) => (json.buffers[0].uri = "/secret.bin")),
        asText: plain((json) => (json.buffers[0].uri = "data:application/octet-stream;base64,AAAA")),
        pictureAsText: plain((json) => (json.images = [{ uri: "data:image/png;base64,iVBORw0KGgo=" }])),
        elsewherePicture: plain((json) => (json.images = [{ uri: "/secret.png" }])),
        cyclic: plain((json) => Object.assign(json.nodes[0], { children: [0] })),
        deep: plain((json) => (json.nodes = Array.from({ length: 5000 }, (_, i) => (i < 4999 ? { children: [i + 1] } : { mesh: 0 })))),
        huge: plain((json) => (json.accessors[0].count = 4_000_000_000)),
        outside: plain((json) => (json.accessors[0].count = 1000)),
        noVertices: plain((json) => (json.meshes[0].primitives[0].attributes = {})),
        nothing: plain((json) => (json.scenes[0].nodes = [])),
        strangeMesh: plain((json) => (json.meshes = [null])),
        textureBomb: withImage(png("\xea\x60")), // 60000
        manyImages: withImage(png("\x3f\xff"), 1, 2), // 16383
        manyTextures: withImage(png("\x20\x00"), 4), // 8192
        texturesOfExtension: withImage(png("\x20\x00"), 4, 1, { extensions: { EXT_texture_avif: { source: 0 } } }),
        jpegWithFill: withImage("\xff\xd8\xff\xff\xff\xc0\0\x11\x08\xff\xdc\xff\xdc"), // 65500
        losslessWebp: withImage(losslessWebp),
        lossyWebp: withImage("RIFF\0\0\0\0WEBPVP8 \0\0\0\0\0\0\0\x9d\x01\x2a\xff\x3f\xff\x3f"),
        otherPicture: withImage("\0\0\0\x20ftypavif"),
        brokenPicture: withImage(png("\0\x08")),
        compressedPicture: (() => {
            const { json, binary } = takeApart(withImage(png("\x00\x01")));
            Object.assign(json.bufferViews[json.images[0].bufferView], { extensions: meshopt(1) });
            return putTogether({ json, binary });
        })(),
        overlapping: plain((json) => json.bufferViews.push(...Array(300).fill({ buffer: 0, byteLength: json.buffers[0].byteLength }))),
        hiddenOverlap: changed((json) => json.bufferViews.push(...Array(20).fill({ buffer: 0, byteLength: json.buffers[0].byteLength, extensions: { OTHER: {} } }))),
        animated: plain((json) => (json.animations = [{ samplers: [{ input: 0, output: 0 }], channels: [] }])),
        morphTargets: plain((json) => (json.meshes[0].primitives[0].targets = Array(2000).fill({ POSITION: 0 }))),
        sharedMesh: plain((json) => (manyVertices(json), (json.nodes = Array.from({ length: 3000 }, () => ({ mesh: 0 }))))),
        sharedVertices: plain((json) => (json.meshes[0].primitives = Array(100_000).fill(json.meshes[0].primitives[0]))),
        instances: plain((json) => (json.nodes[0].extensions = { EXT_mesh_gpu_instancing: { attributes: {} } })),
        matrices: plain((json) => json.accessors.push({ count: 4e6, type: "MAT4", componentType: 5126 })),
        meshoptLies: changed((json) => json.bufferViews.forEach(({ extensions }) => extensions && Object.values(extensions).forEach((e) => (e.count = 1e7)))),
        meshoptSecond: plain((json) => (json.bufferViews[0].extensions = { OTHER: {}, ...meshopt(4e6) })),
        meshoptNegative: plain((json) => json.bufferViews.push({ extensions: meshopt(-1e15) }, { extensions: meshopt(4e6) })),
        ...Object.fromEntries(
            Object.entries({ flat: [1, 1e-9], wide: [1, 1e6], narrow: [1, 0.04], negative: [1, -1], text: [1, "2"], noWidth: [1, 0] }).map(([name, camera]) => [`${name}Camera`, withCamera(...camera)]),
        ),
        ...Object.fromEntries([0, -1, 4, 1e300, "1", null].map((yfov) => [`fieldOfView ${yfov}`, withCamera(yfov, 1)])),
        lights: plain((json) => Object.assign(json, { extensions: { KHR_lights_punctual: { lights: [{ type: "directional" }] } } })),
        transmission: plain((json) => (json.materials[0].extensions.KHR_materials_transmission = { transmissionFactor: 1 })),
        textAsCount: plain((json) => json.accessors.push({ count: "1e-9", type: "SCALAR" }, { count: 4e9, type: "SCALAR" })),
    };
}

/** Copies a buffer, which may be a part of a larger one. */
const bytesOf = (buffer) => new Uint8Array(buffer).buffer;

const pathOf = (name) => execFileSync("sh", ["-c", `command -v ${name}`], { encoding: "utf8" }).trim();

/** Starts a browser with an empty profile. Firefox has WebGL only on a screen, such as that of xvfb-run. */
function startBrowser(kind) {
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

let [passed, failed] = [0, 0];
let browser;
let kind = "";

/** Replaces a browser that does not answer: on a busy machine, Firefox was silent for three minutes twice. */
async function restart(failure) {
    console.log(`restarts ${kind}: ${failure.message}`);
    browser.process().kill("SIGKILL");
    browser = await startBrowser(kind);
}

async function newPage() {
    try {
        return await browser.newPage();
    } catch (failure) {
        await restart(failure);
        return browser.newPage();
    }
}

/** Runs a test, and runs it once more if the browser does not answer. */
async function test(fact, check, isRepeated = false) {
    if (onlyWord && !fact.includes(onlyWord)) return;
    const page = await newPage();
    page.setDefaultTimeout(90_000);
    page.errors = [];
    page.on("pageerror", (error) => page.errors.push(error.message));
    try {
        await check(page);
        assert.deepEqual(page.errors, [], "no errors on the page");
        passed += 1;
        console.log(`passed: ${kind}: ${fact}`);
    } catch (failure) {
        if (failure instanceof ProtocolError && failure.message.includes("timed out") && !isRepeated) {
            await restart(failure);
            return test(fact, check, true);
        }
        failed += 1;
        console.log(`FAILED: ${kind}: ${fact}\n${failure.stack}`);
    }
    await page.close();
}

const open = async (page, path, size) => {
    if (kind === "chromium") await page.setViewport(size);
    else await page.setViewport({ width: size.width, height: size.height }); // Firefox emulates no phones
    await page.goto(site + path);
};
const statistics = (page) => page.evaluate(() => customElements.get("photo-3d").statistics());
const scrolled = (page) => page.evaluate(() => scrollY);
/** Waits until the page stops scrolling. */
const calm = (page) =>
    page.evaluate(async () => {
        let [before, still] = [-1, 0];
        while (still < 5) {
            await new Promise((resolve) => setTimeout(resolve, 50));
            still = scrollY === before ? still + 1 : 0;
            before = scrollY;
        }
    });

/** Scrolls by wheel over the middle of the window. Returns the scroll positions of the page. */
async function scrollByWheel(page, steps, size) {
    await page.mouse.move(size.width / 2, size.height / 2);
    const places = [];
    for (const step of steps) {
        const before = await scrolled(page);
        await page.mouse.wheel({ deltaY: step });
        await page.waitForFunction((before) => scrollY !== before, {}, before); // the browser delivers wheel events with a delay
        await calm(page);
        places.push(await scrolled(page));
    }
    return places;
}

async function scrollByTouch(page, steps, size) {
    const devtools = await page.createCDPSession();
    const places = [];
    for (const step of steps) {
        await devtools.send("Input.synthesizeScrollGesture", { x: size.width / 2, y: size.height / 2, yDistance: -step, gestureSourceType: "touch", preventFling: true, speed: 4000 });
        await calm(page);
        places.push(await scrolled(page));
    }
    return places;
}

const inMiddle = () => {
    const all = [...document.querySelectorAll("photo-3d")];
    return all.find((shown) => Math.abs(shown.getBoundingClientRect().top + shown.offsetHeight / 2 - innerHeight / 2) < shown.offsetHeight / 2 + 40);
};
const waitForMiddle = (page) => page.waitForFunction(`(${inMiddle})()?.complete`);

/** Waits until all visible photos are loaded and at rest, and nothing is drawn. */
async function waitForRest(page) {
    await page.waitForFunction(() =>
        [...document.querySelectorAll("photo-3d")].every((shown) => {
            const { top, bottom } = shown.getBoundingClientRect();
            return bottom <= 0 || top >= innerHeight || (shown.complete && !shown.state().isMoving);
        }),
    );
    for (let [before, still] = [-1, 0]; still < 3; ) {
        const { frames } = await statistics(page);
        still = frames === before ? still + 1 : 0;
        before = frames;
        await new Promise((resolve) => setTimeout(resolve, 500));
    }
}

async function testFeed(name, size, scroll, way) {
    await test(`on a ${name}, a feed of 50 photos scrolls by ${way} like a feed of plain pictures`, async (page) => {
        const steps = [300, 500, 700, 350, 200, -400, 600, 400];
        await open(page, "/flat.html", size);
        const expected = await scroll(page, steps, size);
        await open(page, "/feed.html", size);
        await waitForMiddle(page);
        const found = await scroll(page, steps, size);
        for (const [i, place] of expected.entries()) assert.ok(Math.abs(place - found[i]) <= 16, `scroll positions: expected ${expected}, found ${found}`);
        await page.screenshot({ path: join(pictures, `${kind}_${name}_${way}.png`) });
        await page.evaluate(async () => {
            for (let y = 0; y < document.body.scrollHeight; y += innerHeight) {
                scrollTo(0, y);
                await new Promise((resolve) => setTimeout(resolve, 60));
            }
        });
        const { photos: most } = await statistics(page);
        await waitForMiddle(page).catch(() => {});
        await waitForRest(page);
        const end = await statistics(page);
        assert.equal(await page.evaluate(() => window.contexts.length), 1, "number of WebGL contexts");
        assert.ok(Math.max(most, end.photos) <= 6, `expected at most 6 photos in memory, found ${most}, and ${end.photos} at the end`);
        await new Promise((resolve) => setTimeout(resolve, 500));
        assert.equal((await statistics(page)).frames, end.frames, "at rest, nothing is drawn");
        const heap = await page.evaluate(() => performance.memory?.usedJSHeapSize ?? 0);
        console.log(`        ${JSON.stringify(end)}, JavaScript heap ${(heap / 1e6).toFixed(0)} MB`);
    });
}

for (kind of onlyBrowser ? [onlyBrowser] : ["chromium", "firefox"]) {
    browser = await startBrowser(kind);
    await testFeed("desktop", sizes.desktop, scrollByWheel, "wheel");
    if (kind === "chromium") {
        await testFeed("phone", sizes.phone, scrollByWheel, "wheel");
        await testFeed("phone", sizes.phone, scrollByTouch, "touch");
    }

    await test("without WebGL, a feed shows posters and scrolls like a feed of plain pictures", async (page) => {
        await page.evaluateOnNewDocument(() => {
            const { getContext } = HTMLCanvasElement.prototype;
            HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
                return kind === "2d" ? getContext.call(this, kind, ...rest) : null;
            };
        });
        const steps = [300, 500, 700, -400];
        await open(page, "/flat.html", sizes.desktop);
        const expected = await scrollByWheel(page, steps, sizes.desktop);
        await open(page, "/feed.html", sizes.desktop);
        assert.deepEqual(await scrollByWheel(page, steps, sizes.desktop), expected);
        const shown = await page.evaluate(() => {
            const { shadowRoot } = document.querySelector("photo-3d");
            return [shadowRoot.getElementById("poster").naturalWidth > 0, shadowRoot.getElementById("message").hidden];
        });
        assert.deepEqual(shown, [true, true]);
        await page.screenshot({ path: join(pictures, `${kind}_without_webgl.png`) });
    });

    await test("without constructable style sheets, the poster inside the element stays visible", async (page) => {
        await page.evaluateOnNewDocument(() => {
            window.CSSStyleSheet = function () {
                throw new TypeError("Illegal constructor");
            };
        });
        await open(page, "/slotted.html", sizes.desktop);
        await page.waitForFunction(() => customElements.get("photo-3d"));
        const { width, height } = await (await page.$("photo-3d img")).boundingBox();
        assert.ok(width > 100 && height > 100);
        assert.ok(page.errors.length > 0 && page.errors.every((message) => /Illegal constructor/.test(message)), String(page.errors));
        page.errors.length = 0;
    });

    await test("the photo moves while the page scrolls, and otherwise stays at rest", async (page) => {
        await open(page, "/feed.html", sizes.desktop);
        await waitForMiddle(page);
        await page.evaluate(() => document.querySelectorAll("photo-3d")[1].scrollIntoView({ block: "center" }));
        await page.waitForFunction(`document.querySelectorAll("photo-3d")[1].complete`);
        await waitForRest(page);
        const reach = () => page.evaluate(() => document.querySelectorAll("photo-3d")[1].state().reach);
        const middle = await reach();
        assert.ok(Math.hypot(middle.right, middle.up, middle.forward) < 0.1, JSON.stringify(middle));
        await page.evaluate(() => scrollBy(0, 300));
        await waitForRest(page);
        const up = await reach();
        assert.ok(up.up > 0.15 && up.forward > 0.25, JSON.stringify(up));
    });

    await test("photos load even if one of them leaves the viewport before the page draws it", async (page) => {
        await page.evaluateOnNewDocument(() => {
            const { requestAnimationFrame } = window;
            const held = [];
            window.requestAnimationFrame = (callback) => held.push(callback); // so that no photo is drawn
            window.drawAgain = () => {
                window.requestAnimationFrame = requestAnimationFrame;
                held.forEach((callback) => requestAnimationFrame(callback));
            };
        });
        await open(page, "/feed.html", sizes.desktop);
        await page.waitForFunction(() => document.querySelector("photo-3d").canvas?.hidden === false, { polling: 100 });
        assert.equal(await page.evaluate(() => document.querySelector("photo-3d").complete), false);
        await page.evaluate(() => document.querySelectorAll("photo-3d")[20].scrollIntoView({ block: "center" }));
        await page.waitForFunction(() => document.querySelector("photo-3d").canvas.hidden, { polling: 100 }); // the first photo is released
        await page.evaluate(() => window.drawAgain());
        await page.waitForFunction(() => document.querySelectorAll("photo-3d")[20].complete, { timeout: 30_000 });
        await page.evaluate(() => scrollTo(0, 0));
        await page.waitForFunction(() => document.querySelector("photo-3d").complete, { timeout: 30_000 });
    });

    await test("photos load even if a server never delivers one of them", async (page) => {
        await open(page, "/stuck.html", sizes.desktop);
        await page.evaluate(() => scrollTo(0, 500));
        await page.waitForFunction(() => document.querySelectorAll("photo-3d")[1].complete, { timeout: 30_000 });
        assert.ok(asked.includes("/silent.glb"));
        assert.equal(await page.evaluate(() => document.querySelector("photo-3d").complete), false);
    });

    await test("axe reports no accessibility violation in a feed", async (page) => {
        await open(page, "/feed.html", sizes.desktop);
        await waitForMiddle(page);
        await page.evaluate(axe);
        const { violations, passes } = await page.evaluate(() => window.axe.run());
        assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`), []);
        assert.ok(passes.length > 5);
    });

    await test("keys affect only a focused photo", async (page) => {
        await open(page, "/feed.html", sizes.desktop);
        await waitForMiddle(page);
        const right = () => page.evaluate(() => document.querySelector("photo-3d").state().reach.right);
        await page.keyboard.press("Tab");
        const focused = await page.evaluate(() => document.activeElement.shadowRoot?.activeElement.id);
        assert.equal(focused, "photo");
        for (let i = 0; i < 5; ++i) await page.keyboard.press("ArrowRight");
        await waitForRest(page);
        assert.ok((await right()) > 0.8, String(await right()));
        await page.evaluate(() => document.querySelector("photo-3d").shadowRoot.activeElement.blur());
        await page.keyboard.press("Home");
        await waitForRest(page);
        assert.ok((await right()) > 0.8, "without focus, a key has no effect");
    });

    await test("the lines that --embed offers show the photo in another page", async (page) => {
        await open(page, "/embedded.html", sizes.desktop);
        await page.waitForFunction(() => document.querySelector("photo-3d")?.complete);
        assert.ok(asked.includes("/sample.glb") && asked.includes("/sample.poster.jpg"));
    });

    await test("in a feed, moving the mouse changes the viewpoint, and a double click does not magnify the photo", async (page) => {
        await open(page, "/feed.html", sizes.desktop);
        await waitForMiddle(page);
        await waitForRest(page);
        const state = () => page.evaluate(() => document.querySelector("photo-3d").state());
        const { x, y, width, height } = await (await page.$("photo-3d")).boundingBox();
        for (let i = 0; i < 2; ++i) await page.mouse.click(x + width / 4, y + height / 4);
        await waitForRest(page);
        const { zoom, reach } = await state();
        assert.equal(zoom, 1, "a double click does not zoom");
        assert.ok(reach.right < -0.3, JSON.stringify(reach));
    });

    if (kind === "chromium")
        await test("on a phone, a horizontal drag changes the viewpoint, and a vertical drag scrolls the page", async (page) => {
            await open(page, "/feed.html", sizes.phone);
            await waitForMiddle(page);
            await waitForRest(page);
            const reach = () => page.evaluate(() => document.querySelector("photo-3d").state().reach.right);
            const { x, y, width, height } = await (await page.$("photo-3d")).boundingBox();
            const [middle, before] = [{ x: x + width / 2, y: y + height / 2 }, await scrolled(page)];
            const finger = await page.touchscreen.touchStart(middle.x, middle.y);
            for (let i = 1; i <= 10; ++i) await finger.move(middle.x - i * 10, middle.y);
            await waitForRest(page);
            assert.ok((await reach()) > 0.5, String(await reach()));
            assert.equal(await scrolled(page), before);
            await finger.end();
            await waitForRest(page);
            assert.ok(Math.abs(await reach()) < 0.1, "after the finger lifts, the viewpoint returns to the center");
            const next = await page.touchscreen.touchStart(middle.x, middle.y);
            for (let i = 1; i <= 10; ++i) await next.move(middle.x, middle.y - i * 30);
            await next.end();
            await calm(page);
            assert.ok((await scrolled(page)) > before + 200, `scrolled from ${before} to ${await scrolled(page)}`);
        });

    if (kind === "chromium")
        await test("on a phone, a swipe that scrolls past a photo does not count as its use, and a drag does", async (page) => {
            await open(page, "/feed.html", sizes.phone);
            await waitForMiddle(page);
            await page.evaluate(() => localStorage.clear());
            const { x, y, width, height } = await (await page.$("photo-3d")).boundingBox();
            const swipe = async (right, down) => {
                const finger = await page.touchscreen.touchStart(x + width / 2, y + height / 2);
                for (let i = 1; i <= 10; ++i) await finger.move(x + width / 2 + i * right, y + height / 2 + i * down);
                await finger.end();
                await calm(page);
                return page.evaluate(() => localStorage.getItem("photo-3d-hint"));
            };
            assert.equal(await swipe(1, -20), null);
            assert.ok((await scrolled(page)) > 100);
            await page.evaluate(() => scrollTo(0, 0));
            await calm(page);
            assert.equal(await swipe(0, 0), null, "a tap");
            assert.equal(await swipe(-10, 0), "seen");
        });

    await test("the share button shares or copies the page's address, or what the page provides instead", async (page) => {
        await open(page, "/one.html", sizes.desktop);
        const outcome = await page.evaluate(async () => {
            const shown = document.createElement("photo-3d");
            for (const [name, value] of Object.entries({ standalone: "", caption: "Toys", src: "/square.glb" })) shown.setAttribute(name, value);
            document.getElementById("place").append(shown);
            await new Promise((resolve) => shown.addEventListener("load", resolve, { once: true }));
            const button = shown.shadowRoot.getElementById("share");
            const shared = [];
            navigator.share = async (what) => shared.push(what);
            button.click();
            navigator.share = undefined;
            const copied = [];
            Object.defineProperty(navigator, "clipboard", { value: { writeText: async (text) => copied.push(text) }, configurable: true });
            button.click();
            await new Promise((resolve) => setTimeout(resolve, 100));
            const message = shown.shadowRoot.getElementById("message").textContent;
            Object.defineProperty(navigator, "clipboard", { value: undefined, configurable: true });
            button.click();
            await new Promise((resolve) => setTimeout(resolve, 100));
            const other = shown.shadowRoot.getElementById("message").textContent;
            const refusals = [];
            for (const name of ["NotAllowedError", "AbortError"]) {
                shown.report("");
                navigator.share = () => Promise.reject(new DOMException("refused", name));
                button.click();
                await new Promise((resolve) => setTimeout(resolve, 100));
                refusals.push(shown.shadowRoot.getElementById("message").textContent);
            }
            shown.addEventListener("share", (event) => event.preventDefault());
            navigator.share = async (what) => shared.push(what);
            button.click();
            await new Promise((resolve) => setTimeout(resolve, 100));
            const caption = shown.shadowRoot.getElementById("caption").innerText;
            return { isHidden: button.hidden, shared, copied, message, other, refusals, caption };
        });
        const url = `${site}/one.html`;
        assert.deepEqual(outcome, {
            isHidden: false,
            shared: [{ title: "Toys", url }],
            copied: [url],
            message: "The address is copied.",
            other: `The address is ${url}`,
            refusals: [`The address is ${url}`, ""],
            caption: "Toys",
        });
    });

    await test("a page can style parts of the photo, and a released photo shows its poster", async (page) => {
        await open(page, "/feed.html", sizes.desktop);
        await waitForMiddle(page);
        const styled = await page.evaluate(() => {
            const sheet = document.createElement("style");
            sheet.textContent = "photo-3d { --photo-3d-text: rgb(1, 2, 3); --photo-3d-inset: 40px } photo-3d::part(controls) { outline: 5px solid }";
            document.head.append(sheet);
            const { color, right, outlineWidth } = getComputedStyle(document.querySelector("photo-3d").shadowRoot.getElementById("controls"));
            return { color, right, outlineWidth };
        });
        assert.deepEqual(styled, { color: "rgb(1, 2, 3)", right: "40px", outlineWidth: "5px" });
        await page.evaluate(() => document.querySelectorAll("photo-3d")[30].scrollIntoView());
        await page.waitForFunction(() => !document.querySelector("photo-3d").complete);
        const poster = await page.evaluate(() => {
            const { canvas, shadowRoot } = document.querySelector("photo-3d");
            return [canvas.hidden, shadowRoot.getElementById("poster").getClientRects().length];
        });
        assert.deepEqual(poster, [true, 1]);
    });

    await test("without photos, the renderer keeps no large canvas, and it draws the next photo", async (page) => {
        await open(page, "/feed.html", sizes.desktop);
        await waitForMiddle(page);
        const width = () => page.evaluate(() => window.contexts[0].canvas.width);
        assert.ok((await width()) > 300);
        await page.evaluate(() => {
            window.removed = document.querySelector("main");
            window.removed.remove();
        });
        assert.equal(await width(), 1);
        await page.evaluate(() => document.body.append(window.removed));
        await waitForMiddle(page);
        assert.ok((await width()) > 300);
        assert.equal((await statistics(page)).contexts, 1);
    });

    await test("the viewer replaces a lost context that the browser does not restore", async (page) => {
        await open(page, "/feed.html", sizes.desktop);
        await waitForMiddle(page);
        await page.evaluate(() => window.contexts[0].getExtension("WEBGL_lose_context").loseContext());
        await page.waitForFunction(() => window.contexts.length === 2);
        await waitForRest(page);
        const isDrawn = await page.evaluate(() => {
            const { canvas } = document.querySelector("photo-3d");
            const { data } = canvas.getContext("2d").getImageData(canvas.width / 2, canvas.height / 2, 1, 1);
            return data[3] === 255 && data[0] + data[1] + data[2] > 30;
        });
        assert.ok(isDrawn);
    });

    await test("a photo that loses three contexts in a row shows its poster and a message, and the viewer makes no further context", async (page) => {
        await page.evaluateOnNewDocument(() => {
            window.isLosing = true;
            const { drawElements } = WebGL2RenderingContext.prototype;
            WebGL2RenderingContext.prototype.drawElements = function (...values) {
                drawElements.apply(this, values);
                if (window.isLosing) this.getExtension("WEBGL_lose_context")?.loseContext();
            };
        });
        await open(page, "/one.html", sizes.desktop);
        await page.evaluate(() => {
            const shown = document.createElement("photo-3d");
            for (const name of ["src", "poster"]) shown.setAttribute(name, { src: "/feed.glb", poster: "/poster.jpg" }[name]);
            document.getElementById("place").append(shown);
        });
        await page.waitForFunction(() => /can't be shown. The browser can't draw it/.test(document.querySelector("photo-3d").shadowRoot.getElementById("message").textContent));
        await new Promise((resolve) => setTimeout(resolve, 3000));
        const found = await page.evaluate(() => {
            const { canvas, complete, shadowRoot } = document.querySelector("photo-3d");
            return [window.contexts.length, canvas.hidden, complete, shadowRoot.getElementById("poster").getClientRects().length];
        });
        assert.ok(found[0] <= 4, `${found[0]} contexts`);
        assert.deepEqual(found.slice(1), [true, false, 1]);
        await page.evaluate(async () => {
            window.isLosing = false;
            await document.querySelector("photo-3d").show(await (await fetch("/feed.glb")).arrayBuffer());
        });
        assert.equal(await page.evaluate(() => document.querySelector("photo-3d").complete), true, "another photo is drawn");
    });

    await test("a photo that can't be drawn does not stop the others", async (page) => {
        await open(page, "/feed.html", sizes.desktop);
        await page.evaluate(() => {
            const [first, second] = document.querySelectorAll("photo-3d");
            first.canvas.getContext("2d").drawImage = () => {
                throw new Error("no canvas");
            };
            second.scrollIntoView();
            scrollBy(0, -300);
        });
        await page.waitForFunction(() => /It can't be drawn: no canvas/.test(document.querySelector("photo-3d").shadowRoot.getElementById("message").textContent));
        await page.waitForFunction(() => document.querySelectorAll("photo-3d")[1].complete);
        assert.equal(await page.evaluate(() => document.querySelector("photo-3d").complete), false);
    });

    for (const ratio of kind === "chromium" ? [1, 3] : [1])
        await test(`the canvas is transparent around a model, with smooth silhouettes at ${ratio} device pixels per CSS pixel`, async (page) => {
            await open(page, "/one.html", { width: 400, height: 400, deviceScaleFactor: ratio });
            const levels = await page.evaluate(async () => {
                const shown = document.createElement("photo-3d");
                shown.setAttribute("sway", "0");
                shown.setAttribute("src", "/square.glb");
                document.getElementById("place").append(shown);
                await new Promise((resolve) => shown.addEventListener("load", resolve, { once: true }));
                shown.lookFrom({ right: 0.3, up: 0.55 });
                await new Promise((resolve) => setTimeout(resolve, 1500));
                const { canvas } = shown;
                const { data, width } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
                const alphas = new Set();
                for (let i = 3; i < data.length; i += 4) alphas.add(data[i]);
                return { corner: data[3], between: [...alphas].filter((a) => a > 0 && a < 255).length, ratio: width / canvas.clientWidth };
            });
            assert.equal(levels.corner, 0);
            assert.ok(levels.between >= 1, JSON.stringify(levels));
            assert.ok(Math.abs(levels.ratio - ratio) < 0.02, JSON.stringify(levels));
        });

    await test("files that need too many resources are refused before three.js reads them", () => {
        for (const name of ["meshoptSecond", "meshoptNegative", "textAsCount", "sharedMesh", "matrices"])
            assert.throws(() => checkGlb(bytesOf(hostile[name])), /too many vertices/, name);
        for (const name of ["textureBomb", "manyImages", "manyTextures", "texturesOfExtension", "jpegWithFill", "losslessWebp", "lossyWebp"])
            assert.throws(() => checkGlb(bytesOf(hostile[name])), /textures are too large/, name);
        assert.throws(() => checkGlb(bytesOf(hostile.otherPicture)), /not PNG, JPEG or WebP/);
        assert.throws(() => checkGlb(bytesOf(hostile.secondJson)), /other parts/);
        assert.throws(() => checkGlb(bytesOf(hostile.compressedPicture)), /compressed a second time/);
        assert.throws(() => checkGlb(bytesOf(hostile.morphTargets)), /morph targets/);
        assert.throws(() => checkGlb(bytesOf(hostile.overlapping)), /overlap/);
        assert.throws(() => checkGlb(bytesOf(hostile.hiddenOverlap)), /overlap/);
        assert.throws(() => checkGlb(bytesOf(hostile.animated)), /animations/);
        assert.throws(() => checkGlb(bytesOf(hostile.sharedVertices)), /too many meshes/);
        assert.throws(() => checkGlb(bytesOf(hostile.instances)), /draws a mesh many times/);
        for (const name of Object.keys(hostile).filter((name) => name.endsWith("Camera"))) assert.throws(() => checkGlb(bytesOf(hostile[name])), /aspect ratio/, name);
        for (const name of Object.keys(hostile).filter((name) => name.startsWith("fieldOfView"))) assert.throws(() => checkGlb(bytesOf(hostile[name])), /field of view/, name);
        assert.throws(() => checkGlb(bytesOf(hostile.lights)), /lights/);
        assert.throws(() => checkGlb(bytesOf(hostile.transmission)), /KHR_materials_transmission/);
        for (const name of ["cyclic", "deep"]) assert.throws(() => checkGlb(bytesOf(hostile[name])), /nested too deeply/, name);
        for (const file of [square(), besideMiddle(), glb]) checkGlb(bytesOf(file));
    });

    await test("hostile files cause an error message and no requests", async (page) => {
        await open(page, "/one.html", sizes.desktop);
        asked.length = 0;
        for (const name of Object.keys(hostile)) {
            const message = await page.evaluate(async (name) => {
                const shown = document.createElement("photo-3d");
                shown.setAttribute("src", `/${name}.glb`);
                document.getElementById("place").replaceChildren(shown);
                const happens = (event) => new Promise((resolve) => shown.addEventListener(event, () => resolve(event), { once: true }));
                const what = await Promise.race([happens("error"), happens("load")]);
                return `${what}: ${shown.shadowRoot.getElementById("message").textContent}`;
            }, name);
            console.log(`        ${name}: ${message}`);
            assert.match(message, /^error: This 3D photo can't be shown\. ./, name);
        }
        assert.deepEqual(asked.filter((path) => path.includes("secret")), []);
        await page.evaluate(() => document.querySelector("photo-3d").setAttribute("src", "/none.glb"));
        await page.waitForFunction(() => document.querySelector("photo-3d").shadowRoot.getElementById("message").textContent.includes("404"));
    });

    await test("properties that a page sets before the module is loaded have effect", async (page) => {
        await open(page, "/early.html", sizes.desktop);
        await page.waitForFunction(() => document.querySelector("photo-3d").complete);
        const found = await page.evaluate(() => {
            const shown = document.querySelector("photo-3d");
            return [window.wasDefined, shown.getAttribute("src"), shown.shadowRoot.getElementById("poster").getAttribute("src"), shown.shadowRoot.getElementById("photo").ariaLabel];
        });
        assert.deepEqual(found, [false, "/feed.glb", "/poster.jpg", "Toys"]);
    });

    await test("a page with a strict Content-Security-Policy shows a compressed photo", async (page) => {
        await open(page, "/strict.html", sizes.desktop);
        await page.waitForFunction(() => document.querySelector("photo-3d").complete);
    });

    await test("a property set to null removes its attribute, and a page may set loading after poster", async (page) => {
        asked.length = 0;
        await open(page, "/one.html", sizes.desktop);
        const found = await page.evaluate(async () => {
            const place = document.getElementById("place");
            place.style.paddingTop = "20000px";
            const shown = Object.assign(document.createElement("photo-3d"), { poster: "/poster.jpg?late", loading: "lazy" });
            place.append(shown);
            const parsed = document.createElement("div");
            parsed.innerHTML = '<photo-3d poster="/poster.jpg?parsed" loading="lazy"></photo-3d>';
            place.append(parsed);
            await new Promise((resolve) => setTimeout(resolve, 500));
            const poster = shown.shadowRoot.getElementById("poster");
            const isLazy = poster.loading === "lazy" && poster.getAttribute("src") === "/poster.jpg?late";
            for (const name of ["poster", "src", "alt"]) shown[name] = null;
            await Promise.resolve();
            return [isLazy, shown.hasAttribute("poster"), shown.poster, poster.hasAttribute("src"), shown.hasAttribute("alt")];
        });
        assert.deepEqual(found, [true, false, "", false, false]);
        assert.deepEqual(asked.filter((path) => /poster|null/.test(path)), []);
    });

    await test('with loading="lazy", posters far below the window are not fetched', async (page) => {
        asked.length = 0;
        await open(page, "/lazy.html", sizes.desktop);
        await page.waitForFunction(() => document.querySelector("photo-3d").complete);
        const posters = asked.filter((path) => path === "/poster.jpg").length;
        assert.ok(posters > 0 && posters < 20, `${posters} of 50 posters`);
    });

    await test("show() rejects with an AbortError if another photo replaces its photo first", async (page) => {
        await open(page, "/one.html", sizes.desktop);
        const results = await page.evaluate(async () => {
            const shown = document.createElement("photo-3d");
            document.getElementById("place").append(shown);
            const [good, other, broken] = await Promise.all(["/feed.glb", "/square.glb", "/text.glb"].map(async (path) => (await fetch(path)).arrayBuffer()));
            const all = await Promise.allSettled([good, broken, broken, other].map((bytes) => shown.show(bytes)));
            return [...all.map(({ status, reason }) => reason?.name ?? status), shown.shadowRoot.getElementById("message").hidden];
        });
        assert.deepEqual(results, ["AbortError", "AbortError", "AbortError", "fulfilled", true]);
    });

    await test("show() accepts arrays of bytes, and buffers of other frames", async (page) => {
        await open(page, "/one.html", sizes.desktop);
        const results = await page.evaluate(async () => {
            const shown = document.createElement("photo-3d");
            const frame = document.createElement("iframe");
            document.getElementById("place").append(shown, frame);
            const bytes = new Uint8Array(await (await fetch("/feed.glb")).arrayBuffer());
            const padded = new Uint8Array(bytes.length + 8);
            padded.set(bytes, 4);
            const foreign = new frame.contentWindow.Uint8Array(bytes);
            const results = [];
            for (const value of [padded.subarray(4, -4), foreign, foreign.buffer]) {
                shown.clear();
                results.push(shown.complete);
                await shown.show(value);
                while (!shown.complete) await new Promise((resolve) => setTimeout(resolve, 20)); // the browser may not know yet that it is in sight
                results.push(shown.complete);
            }
            return results;
        });
        assert.deepEqual(results, [false, true, false, true, false, true]);
    });

    await test("another photo starts without magnification, and its shape is known before it is drawn", async (page) => {
        await open(page, "/one.html", sizes.desktop);
        await page.evaluate(async () => {
            const shown = document.createElement("photo-3d");
            shown.setAttribute("standalone", "");
            document.getElementById("place").append(shown);
            window.bytes = await (await fetch("/feed.glb")).arrayBuffer();
            await shown.show(window.bytes);
        });
        for (let i = 0; i < 4; ++i) await page.keyboard.press("+");
        await page.waitForFunction(() => document.querySelector("photo-3d").state().zoom > 1.5);
        const found = await page.evaluate(async () => {
            const shown = document.querySelector("photo-3d");
            const drawn = new Promise((resolve) => shown.addEventListener("load", () => resolve(shown.state().zoom), { once: true }));
            shown.show(window.bytes);
            const zoom = await drawn;
            shown.removeAttribute("standalone");
            const shape = () => parseFloat(shown.shadowRoot.getElementById("box").style.aspectRatio).toFixed(2); // "0.75 / 1"
            const before = shape();
            for (const [name, value] of [["width", 300], ["height", 200]]) shown.setAttribute(name, value);
            shown.clear();
            return [zoom, before, shape(), shown.state().angles];
        });
        assert.deepEqual(found, [1, "0.75", "1.50", null]);
    });

    await test("a decorative photo (alt is empty) has no focus stop, no buttons and no role for screen readers, unless it fills the screen", async (page) => {
        await open(page, "/feed.html", sizes.desktop);
        const states = await page.evaluate(() => {
            const shown = document.querySelector("photo-3d");
            const photo = shown.shadowRoot.getElementById("photo");
            const state = () => [photo.getAttribute("aria-hidden"), photo.hasAttribute("tabindex"), shown.shadowRoot.getElementById("controls").hidden];
            const states = ["", "Toys"].map((text) => {
                shown.alt = text;
                return state();
            });
            shown.alt = "";
            shown.setAttribute("standalone", "");
            return [...states, state()];
        });
        assert.deepEqual(states, [["true", false, true], ["false", true, false], ["false", true, false]]);
    });

    if (kind === "chromium")
        await test("screen readers find the keys' description, and names of buttons that include the photo's description", async (page) => {
            await open(page, "/feed.html", sizes.desktop);
            await waitForMiddle(page);
            await page.evaluate(() => (document.querySelectorAll("photo-3d")[1].alt = "A wooden train with four cars, a red bus and a green boat on a long table"));
            const nodes = [];
            const collect = (node) => (nodes.push(node), (node.children ?? []).forEach(collect));
            collect(await page.accessibility.snapshot());
            const names = (role) => nodes.filter((node) => node.role === role).map(({ name }) => name);
            assert.equal(names("application")[0], "Toys, 0");
            assert.deepEqual(names("button").slice(0, 2), ["Full screen Toys, 0", "Full screen A wooden train with four cars, a red bus and a green boat …"]);
            const photo = nodes.find(({ role }) => role === "application");
            assert.equal(photo.roledescription, "interactive photo");
            assert.match(photo.description, /^Arrow keys look around/);
        });

    await test("a photo inside a shadow tree fills the screen, and leaves it", async (page) => {
        await open(page, "/one.html", sizes.desktop);
        await page.bringToFront();
        await page.waitForFunction(() => document.hasFocus()); // Firefox refuses full screen to a page without the focus
        await page.evaluate(() => {
            const shown = Object.assign(document.createElement("photo-3d"), { id: "inner", src: "/feed.glb" });
            document.getElementById("place").attachShadow({ mode: "open" }).append(shown);
        });
        await page.waitForFunction(() => document.getElementById("place").shadowRoot.getElementById("inner").complete);
        const isAlone = () => document.getElementById("place").shadowRoot.getElementById("inner").isAlone;
        const button = await page.evaluateHandle(() => document.getElementById("place").shadowRoot.getElementById("inner").shadowRoot.getElementById("fullscreen"));
        await button.click();
        await page.waitForFunction(isAlone);
        const changes = await page.evaluate(async () => {
            const other = Object.assign(document.createElement("photo-3d"), { id: "other" });
            document.body.append(other);
            await new Promise((resolve) => setTimeout(resolve, 300)); // for its first layout
            const observer = new MutationObserver(() => {});
            observer.observe(other.shadowRoot, { attributes: true, childList: true, subtree: true });
            document.dispatchEvent(new Event("fullscreenchange"));
            return observer.takeRecords().length;
        });
        assert.equal(changes, 0, "changes of another element");
        await button.evaluate((fullscreen) => fullscreen.click()); // Firefox's notice may cover the button
        await page.waitForFunction(`!(${isAlone})()`);
    });

    for (const layer of ["in the top layer", "without popovers"])
        await test(`without full-screen support (iPhones), the element covers the page ${layer}, and Escape uncovers it`, async (page) => {
            await open(page, "/feed.html", sizes.desktop);
            await waitForMiddle(page);
            const size = await page.evaluate(async (isTopLayer) => {
                const shown = document.querySelector("photo-3d");
                if (isTopLayer) Object.assign(shown.parentElement.style, { transform: "translateX(50px) scale(0.5)", filter: "blur(0)", contain: "strict" });
                else shown.shadowRoot.getElementById("box").showPopover = undefined;
                shown.requestFullscreen = undefined;
                await shown.enterFullscreen();
                const box = shown.shadowRoot.getElementById("box");
                const { x, y, width, height } = box.getBoundingClientRect();
                const top = shown.shadowRoot.elementFromPoint(innerWidth / 2, 20);
                return [x, y, width, height, innerWidth, innerHeight, box.contains(top)];
            }, layer === "in the top layer");
            assert.deepEqual([size[0], size[1], size[3], size[6]], [0, 0, size[5], true], String(size));
            assert.ok(size[2] >= size[4] - 20, String(size)); // the scroll bar
            await page.keyboard.press("Escape");
            assert.equal(await page.evaluate(() => document.querySelector("photo-3d").isAlone), false);
            const isInPage = await page.evaluate(async () => {
                const shown = document.querySelector("photo-3d");
                await shown.enterFullscreen();
                const { parentElement } = shown;
                shown.remove();
                parentElement.append(shown);
                return !shown.isAlone && shown.shadowRoot.getElementById("photo").offsetWidth > 0;
            });
            assert.ok(isInPage, "an element that moves in the page no longer covers it");
        });

    await test("the gallery of a batch lists photos and failures, and filters them", async (page) => {
        await open(page, "/gallery/index.html", sizes.desktop);
        await page.waitForFunction(() => document.querySelector("photo-3d")?.complete);
        const text = () => page.$eval("#count", (count) => count.textContent);
        assert.equal(await text(), "3 of 3 shown; 2 photos converted, 1 failed");
        await page.screenshot({ path: join(pictures, `${kind}_gallery.png`) });
        await page.evaluate(axe);
        const { violations } = await page.evaluate(() => window.axe.run());
        assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`), []);
        await page.click("#failures");
        assert.match(await text(), /^1 of 3/);
        assert.match(await page.$eval(".failed", (entry) => entry.innerText), /broken\.jpg/);
        await page.click("#failures");
        await page.type("#search", "two");
        assert.match(await text(), /^1 of 3/);
    });
    await browser.close();
}
server.close();

const packed = gzipSync(readFileSync(moduleFile), { level: 9 }).length;
console.log(`        the module: ${packed} bytes with gzip`);
packed <= 250_000 ? (passed += 1) : (failed += 1);
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed === 0 ? 0 : 1);
