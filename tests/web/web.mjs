// node web.mjs [WORD]: tests the page of examples/web in Chromium and Firefox. run.sh builds the page, the program, and the files of `made`.
// Ends with "N passed, N failed".

import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { createHash } from "node:crypto";
import { cp, mkdir, readFile, stat, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { dirname, extname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { takeApart } from "../viewer/glb.mjs";
import { PageTests } from "../viewer/page_tests.mjs";
import { choose, convert, openPage, startBrowser, waitForResult } from "./browsers.mjs";
import { crc32, grayPng, withAppleDepth, withDynamicDepth, withGdepth } from "./phone_files.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const top = join(here, "../..");
const program = process.env.PROGRAM ?? join(top, "build/photo3d/examples/photo3d");
const onePage = pathToFileURL(join(top, "build/web/photo3d.html")).href;
const site = join(top, "build/web/site");
const made = join(top, "out/web"); // input and output files of the tests
await mkdir(made, { recursive: true });
const sample = join(top, "examples/photo3d/sample.jpg");
const sampleBytes = await readFile(sample);

const tests = new PageTests(process.argv[2]);
const test = (fact, open, check) => tests.run(fact, open, check, (page) => page === shared);

/** A shared page for tests that only convert, because opening a page takes longer than most of these tests. */
let shared = null;

/** Runs the program on a file that it must refuse. Returns its message, without "photo3d: ". */
function messageOfProgram(name) {
    const { status, stderr } = spawnSync(program, [name, "-o", "refused.glb", "--quiet"], { cwd: made, encoding: "utf8" });
    assert.equal(status, 1, `the program refuses ${name}`);
    return stderr.trim().replace(/^photo3d: /, "");
}

/** Converts a file with the program. Returns the GLB, and the texture before encoding. */
async function convertWithProgram(name) {
    execFileSync(program, [name, "-o", "program.glb", "--stages", "stages", "--quiet"], { cwd: made });
    return { glb: await readFile(join(made, "program.glb")), atlas: await readFile(join(made, "stages/10_atlas.png")) };
}

/** Returns the parts of a GLB that don't depend on the texture's encoding: the mesh, and the JSON without sizes and offsets. */
function contentOf(glb) {
    const { json, binary } = takeApart(glb);
    const viewOf = ({ byteOffset = 0, byteLength }) => binary.subarray(byteOffset, byteOffset + byteLength);
    const image = viewOf(json.bufferViews[json.images[0].bufferView]);
    const pictures = new Set(json.images.map(({ bufferView }) => bufferView));
    const numbers = json.bufferViews.filter((_, i) => !pictures.has(i)).map((view) => viewOf(view).toString("base64"));
    const { buffers, bufferViews, images, ...rest } = json;
    return { image, numbers, rest };
}

/** Returns the number of pixels that differ between two PNG files, counted by the browser. */
const differentPixels = (page, a, b) =>
    page.evaluate(
        async (...files) => {
            const [a, b] = await Promise.all(
                files.map(async (file) => {
                    const picture = await createImageBitmap(new Blob([Uint8Array.from(atob(file), (c) => c.charCodeAt(0))]));
                    const context = new OffscreenCanvas(picture.width, picture.height).getContext("2d");
                    context.drawImage(picture, 0, 0);
                    return context.getImageData(0, 0, picture.width, picture.height);
                }),
            );
            if (a.width !== b.width || a.height !== b.height) return Infinity;
            let count = 0;
            for (let i = 0; i < a.data.length; i += 4) count += [0, 1, 2].some((c) => a.data[i + c] !== b.data[i + c]);
            return count;
        },
        a.toString("base64"),
        b.toString("base64"),
    );

/** Checks that the page converts a file to the same GLB as the program. */
async function assertEqualsProgram(page, name) {
    const { glb, atlas } = await convertWithProgram(name);
    const ours = await convert(page, name, await readFile(join(made, name)), true);
    const [expected, found] = [contentOf(glb), contentOf(ours.glb)];
    assert.deepEqual(found.rest, expected.rest);
    assert.deepEqual(found.numbers, expected.numbers, "bytes of positions, texture coordinates and indices");
    assert.equal(await differentPixels(page, found.image, atlas), 0, "number of different texture pixels");
    return ours;
}

/** Headers that isolate a page from other sites. */
const isolation = { "cross-origin-opener-policy": "same-origin", "cross-origin-embedder-policy": "require-corp" };

/**
 * Serves the folder. `stop` ends the server, as if the network were lost. `sent` has the names of all files that were sent.
 *
 * @param {string} folder
 * @param {object | ((name: string) => object)} [headers]
 * @param {(name: string) => boolean} [isMissing]
 */
async function serve(folder, headers = {}, isMissing = () => false) {
    const sent = [];
    const types = { ".html": "text/html", ".js": "text/javascript", ".gz": "application/gzip" };
    const server = createServer(async (request, response) => {
        const name = new URL(request.url, "http://localhost").pathname.replace(/\/$/, "/index.html");
        const bytes = isMissing(name) ? null : await readFile(join(folder, name)).catch(() => null);
        const etag = bytes ? { etag: `"${createHash("sha1").update(bytes).digest("hex")}"` } : {};
        const isKnown = bytes !== null && request.headers["if-none-match"] === etag.etag;
        response.writeHead(isKnown ? 304 : bytes ? 200 : 404, { "content-type": types[extname(name)] ?? "application/octet-stream", ...etag, ...(typeof headers === "function" ? headers(name) : headers) });
        if (bytes && !isKnown) sent.push(name);
        response.end(isKnown ? null : bytes);
    });
    await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
    const stop = () => {
        server.closeAllConnections();
        return new Promise((resolve) => server.close(resolve));
    };
    return { address: `http://localhost:${server.address().port}/`, stop, sent };
}

/** Returns a JPEG with the camera's orientation in its EXIF block. */
function withOrientation(jpeg, orientation) {
    const tiff = Buffer.from([0x4d, 0x4d, 0, 42, 0, 0, 0, 8, 0, 1, 0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, orientation, 0, 0, 0, 0, 0, 0]);
    const body = Buffer.concat([Buffer.from("Exif\0\0"), tiff]);
    return Buffer.concat([jpeg.subarray(0, 2), Buffer.from([0xff, 0xe1, 0, body.length + 2]), body, jpeg.subarray(2)]);
}

/** A PNG whose header states 100,000 x 100,000 pixels. */
function hugePng() {
    const header = Buffer.from("49484452000186a0000186a00802000000", "hex");
    const checksum = Buffer.alloc(4);
    checksum.writeUInt32BE(crc32(header));
    return Buffer.concat([Buffer.from("89504e470d0a1a0a0000000d", "hex"), header, checksum, Buffer.alloc(200)]);
}

execFileSync(program, [sample, "-o", "sample.glb", "--stages", "sample", "--quiet"], { cwd: made });
await writeFile(join(made, "photo.png"), await readFile(join(made, "sample/01_photo.png")));
await writeFile(join(made, "turned.jpg"), withOrientation(sampleBytes, 6));
const refused = {
    "empty.jpg": Buffer.alloc(0),
    "text.jpg": Buffer.from("This is no picture.\n"),
    "cut.png": (await readFile(join(made, "photo.png"))).subarray(0, 20_000),
    "cut.jpg": sampleBytes.subarray(0, 300),
    "huge.png": hugePng(),
};
for (const [name, bytes] of Object.entries(refused)) await writeFile(join(made, name), bytes);

const isInMotion = async (page) => {
    const state = () => page.evaluate(() => JSON.stringify(document.getElementById("frame").contentDocument.querySelector("photo-3d").state().reach));
    const before = await state();
    await page.waitForFunction((before) => JSON.stringify(document.getElementById("frame").contentDocument.querySelector("photo-3d").state().reach) !== before, {}, before);
};

for (const kind of ["chromium", "firefox"]) {
    const browser = await startBrowser(kind);
    const open = (options) => () => openPage(browser, onePage, options);
    const openShared = async () => (shared ??= await openPage(browser, onePage));

    await test(`${kind}: the page as a single local file converts a photo to a 3D photo that moves on its own`, open(), async (page) => {
        await page.screenshot({ path: join(made, `${kind}_empty.png`) });
        const result = await choose(page, sample);
        assert.equal(result.error, undefined);
        await isInMotion(page);
        await page.screenshot({ path: join(made, `${kind}_shown.png`) });
        const photo = await page.evaluate(() => {
            const { width, height, isPastFrame, stages } = window.photo3d.shown().photo;
            return { width, height, isPastFrame, stages };
        });
        assert.deepEqual([photo.width, photo.height, photo.isPastFrame], [1152, 1536, true]);
        assert.equal(Object.keys(photo.stages).length, 10, "number of stages that report their time");
        assert.deepEqual(page.requests, [], "no requests");
    });

    await test(`${kind}: the GLB of a PNG equals the program's`, openShared, (page) => assertEqualsProgram(page, "photo.png"));

    await test(`${kind}: refused files show the program's messages`, openShared, async (page) => {
        for (const name of Object.keys(refused)) {
            const { error } = await choose(page, join(made, name));
            const expected = messageOfProgram(name);
            // Readable formats depend on the build and on the browser.
            const comparable = (text) => text?.replace(/expected a JPEG.*, found/, "expected a photo, found");
            assert.equal(comparable(error), comparable(expected));
        }
        await page.screenshot({ path: join(made, `${kind}_refused.png`) });
        assert.equal((await convert(page, "photo.jpg", sampleBytes)).facts.width, 1152, "the next photo is converted");
    });

    if (kind === "chromium") await testsOfChromium(browser, open, openShared);
    shared = null;
    await browser.close();
}

async function testsOfChromium(browser, open, openShared) {
    await test("a photo with a rotated camera is upright, as in the program", openShared, async (page) => {
        const { facts } = await assertEqualsProgram(page, "turned.jpg");
        assert.deepEqual([facts.width, facts.height], [1536, 1152]);
    });

    await test("the page uses a depth map beside the photo, like the program", openShared, async (page) => {
        await writeFile(join(made, "beside.png"), Buffer.from(await besideDepth(page), "base64"));
        const { facts } = await assertEqualsProgram(page, "beside.png");
        assert.equal(facts.depthSource, "the right half");
    });

    await test("like the program, the page uses depth maps inside phone photos: GDepth, Dynamic Depth, Apple's format", openShared, async (page) => {
        // A slope with a box in front of it.
        const map = grayPng(64, 48, (y, x) => Math.round(20 + y) + (Math.abs(y - 32) < 12 && Math.abs(x - 24) < 10 ? 120 : 0));
        const mapJpeg = Buffer.from(await jpegOf(page, map), "base64");
        const photos = {
            "GDepth, RangeInverse": withGdepth(sampleBytes, map),
            "Dynamic Depth, RangeLinear": withDynamicDepth(sampleBytes, map),
            "Apple disparity": withAppleDepth(sampleBytes, mapJpeg),
        };
        const meshes = new Set();
        for (const [source, bytes] of Object.entries(photos)) {
            await writeFile(join(made, "phone.jpg"), bytes);
            const { facts, glb } = await assertEqualsProgram(page, "phone.jpg");
            assert.equal(facts.depthSource, source);
            meshes.add(contentOf(glb).numbers.join());
        }
        assert.equal(meshes.size, 3, "the three formats are read as different depth");
    });

    await test("if the depth map inside a photo is unusable, the page states the reason and estimates depth", openShared, async (page) => {
        const map = grayPng(64, 48, () => 7);
        const { facts, glb } = await convert(page, "sample.jpg", withGdepth(sampleBytes, map, "Upside"), true);
        assert.match(facts.depthSource, /GDepth: expected RangeInverse or RangeLinear, found Upside/);
        const plain = await convert(page, "sample.jpg", sampleBytes, true);
        assert.deepEqual(contentOf(glb).numbers, contentOf(plain.glb).numbers);
    });

    await test("the page as a single file has no HEIC reader and explains how to convert a HEIC photo", openShared, async (page) => {
        const heic = Buffer.concat([Buffer.from("\0\0\0\x18ftypheic\0\0\0\0mif1heic", "latin1"), Buffer.alloc(100)]);
        const message = await page.evaluate(
            (bytes) => window.photo3d.converter.convert(Uint8Array.from(bytes), "IMG_1.HEIC", () => {}).then(() => "no message", (failure) => failure.message),
            [...heic],
        );
        assert.match(message, /^IMG_1\.HEIC: expected .* or another format that this browser reads, found .*HEI[CF].*, which this page reads only when opened from a server: open the page from a server, or save the photo as JPEG \(unsupported\)$/);
    });

    await test("the page converts formats that only the browser reads", openShared, async (page) => {
        const webp = await page.evaluate(async (content) => {
            const picture = await createImageBitmap(new Blob([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))]));
            const canvas = new OffscreenCanvas(600, 800);
            canvas.getContext("2d").drawImage(picture, 0, 0, 600, 800);
            const bytes = new Uint8Array(await (await canvas.convertToBlob({ type: "image/webp", quality: 0.9 })).arrayBuffer());
            return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
        }, sampleBytes.toString("base64"));
        const { facts } = await convert(page, "photo.webp", Buffer.from(webp, "base64"));
        assert.deepEqual([facts.width, facts.height], [600, 800]);
    });

    await test("the page refuses photos with too many pixels before the browser decodes them", openShared, async (page) => {
        const ispe = Buffer.concat([Buffer.from("\0\0\0\x20ftypavif\0\0\0\0avifmif1\0\0\0\0\0\0\0\x14ispe\0\0\0\0", "latin1"), Buffer.from([0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]), Buffer.alloc(100)]);
        const files = {
            "huge.webp": ["16383 x 16383", Buffer.concat([Buffer.from("RIFF\0\0\0\0WEBPVP8L\0\0\0\0\x2f\xfe\xbf\xff\x0f", "latin1"), Buffer.alloc(100)])],
            "huge.avif": ["60000 x 60000", ispe],
        };
        for (const [name, [size, bytes]] of Object.entries(files)) {
            const message = await page.evaluate(
                (bytes, name) => window.photo3d.converter.convert(Uint8Array.from(bytes), name, () => {}).then(() => "no message", (failure) => failure.message),
                [...bytes],
                name,
            );
            assert.equal(message, `${name}: expected at most 200000000 pixels, found ${size} (too large)`);
        }
    });

    await test("users can drop and paste photos on the page and on the 3D photo", openShared, async (page) => {
        const give = (kind, where) =>
            page.evaluate(
                async (content, kind, where) => {
                    document.getElementById("status").textContent = "";
                    const inside = where === "frame" ? document.getElementById("frame").contentWindow : window;
                    const transfer = new inside.DataTransfer();
                    transfer.items.add(new File([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))], `${kind}.jpg`, { type: "image/jpeg" }));
                    const options = { bubbles: true, cancelable: true };
                    const event =
                        kind === "drop"
                            ? new inside.DragEvent("drop", { ...options, dataTransfer: transfer })
                            : new inside.ClipboardEvent("paste", { ...options, clipboardData: transfer });
                    inside.document.body.dispatchEvent(event);
                },
                sampleBytes.toString("base64"),
                kind,
                where,
            );
        for (const [kind, where] of [["drop", "page"], ["paste", "page"], ["drop", "frame"], ["paste", "frame"]]) {
            await give(kind, where);
            assert.match((await waitForResult(page)).status, new RegExp(`^${kind} is ready`));
        }
    });

    await test("after an error, the focus is on the button that chooses a photo", open(), async (page) => {
        const focused = () => page.evaluate(() => document.activeElement.id);
        await page.focus("#choose");
        await choose(page, join(made, "text.jpg"));
        assert.equal(await focused(), "choose");
        await choose(page, sample);
        await page.focus("#again");
        await choose(page, join(made, "text.jpg"));
        assert.equal(await focused(), "again");
    });

    await test("the page saves a GLB, an HTML page whose photo moves on its own, and a video", open({ width: 480, height: 640 }), async (page) => {
        await choose(page, sample);
        await page.evaluate(() => {
            window.saved = [];
            HTMLAnchorElement.prototype.click = function () {
                const { href, download } = this;
                window.saved.push(
                    fetch(href)
                        .then((response) => response.arrayBuffer())
                        .then((buffer) => {
                            const bytes = new Uint8Array(buffer);
                            let text = "";
                            for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
                            return [download, btoa(text)];
                        }),
                );
            };
        });
        await page.click("#glb");
        await page.click("#page");
        await page.evaluate(() => void Object.assign(document.getElementById("frame").style, { width: "303px", height: "404px" }));
        await page.waitForFunction(() => document.getElementById("frame").contentDocument.querySelector("photo-3d").canvas.width % 2 === 1);
        await page.click("#video");
        await page.waitForFunction(() => document.documentElement.dataset.view === "recording");
        await page.screenshot({ path: join(made, "recording.png") });
        await page.evaluate(() => {
            const data = new DataTransfer();
            data.items.add(new File(["no picture"], "other.jpg"));
            dispatchEvent(new DragEvent("drop", { dataTransfer: data })); // must not interrupt the recording
        });
        await page.waitForFunction(() => /video is saved/.test(document.getElementById("status").textContent));
        const saved = Object.fromEntries((await page.evaluate(() => Promise.all(window.saved))).map(([name, text]) => [name, Buffer.from(text, "base64")]));
        const video = Object.keys(saved).find((name) => /\.(webm|mp4)$/.test(name));
        assert.deepEqual(Object.keys(saved), ["sample.glb", "sample.html", video]);
        assert.equal(saved["sample.glb"].toString("latin1", 0, 4), "glTF");
        await writeFile(join(made, "saved.html"), saved["sample.html"]);
        await writeFile(join(made, video), saved[video]);
        const facts = JSON.parse(execFileSync("ffprobe", ["-v", "error", "-count_frames", "-show_entries", "stream=width,height,nb_read_frames", "-of", "json", join(made, video)]));
        console.log(`        ${video}: ${saved[video].length} bytes, ${JSON.stringify(facts.streams[0])}`);
        const { nb_read_frames, width, height } = facts.streams[0];
        assert.ok(Number(nb_read_frames) > 10, "the video has pictures");
        assert.deepEqual([width % 2, height % 2], [0, 0], "even sides, as H.264 needs them");
        const own = await browser.newPage();
        await own.goto(pathToFileURL(join(made, "saved.html")).href);
        await own.waitForFunction(() => document.querySelector("photo-3d")?.state().reach.right > 0.05);
        assert.equal(await own.title(), "sample");
        await own.close();
    });

    await test("a video is not saved if the page is hidden during the recording", open({ width: 480, height: 640 }), async (page) => {
        await choose(page, sample);
        await page.click("#video");
        await page.waitForFunction(() => document.documentElement.dataset.view === "recording");
        await page.evaluate(() => {
            Object.defineProperty(document, "hidden", { value: true, configurable: true });
            document.dispatchEvent(new Event("visibilitychange"));
        });
        await page.waitForFunction(() => /page was hidden .*record again/.test(document.getElementById("error").textContent));
        assert.equal(await page.evaluate(() => document.documentElement.dataset.view), "shown");
    });

    const withoutWebgl = () => {
        const { getContext } = HTMLCanvasElement.prototype;
        HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
            return /webgl/.test(kind) ? null : getContext.call(this, kind, ...rest);
        };
    };
    await test("without WebGL, the page converts photos and saves files, but offers no video", open({ first: withoutWebgl }), async (page) => {
        for (const path of [sample, join(made, "turned.jpg")]) assert.match((await choose(page, path)).status, /is ready/);
        const { message, isVideoHidden, isGlbDisabled } = await page.evaluate(() => {
            const shown = document.getElementById("frame").contentDocument.querySelector("photo-3d");
            const { hidden } = document.getElementById("video");
            return { message: shown.shadowRoot.getElementById("message").textContent, isVideoHidden: hidden, isGlbDisabled: document.getElementById("glb").disabled };
        });
        assert.match(message, /WebGL/);
        assert.deepEqual([isVideoHidden, isGlbDisabled], [true, false]);
        page.errors = page.errors.filter((line) => !/WebGL/.test(line));
    });

    const withoutDrawing = () => {
        if (window !== window.top) window.requestAnimationFrame = () => 1;
    };
    await test("while the viewer draws nothing, the page saves files, and it shows the flat photo after some seconds", open({ first: withoutDrawing }), async (page) => {
        const converting = choose(page, sample);
        await page.waitForFunction(() => document.documentElement.dataset.view === "shown");
        const disabled = () => page.evaluate(() => ["glb", "page", "video", "again"].filter((id) => document.getElementById(id).disabled));
        assert.deepEqual(await disabled(), ["video", "again"]);
        await page.evaluate(() => {
            window.saved = [];
            HTMLAnchorElement.prototype.click = function () {
                window.saved.push(this.download);
            };
        });
        for (const id of ["glb", "page"]) await page.click(`#${id}`);
        await page.waitForFunction(() => window.saved.length === 2);
        assert.deepEqual(await page.evaluate(() => window.saved), ["sample.glb", "sample.html"]);
        assert.match((await converting).status, /^sample is ready\. .*This is the flat photo/);
        assert.deepEqual(await disabled(), []);
        const state = await page.evaluate(() => {
            const shown = document.getElementById("frame").contentDocument.querySelector("photo-3d");
            return [shown.complete, shown.shadowRoot.getElementById("poster").naturalWidth > 0, document.getElementById("video").hidden];
        });
        assert.deepEqual(state, [false, true, true]);
    });

    await test("the next photo replaces the first one, in the same WebGL context", open(), async (page) => {
        for (const path of [sample, join(made, "turned.jpg")]) assert.equal((await choose(page, path)).error, undefined);
        const found = await page.evaluate(() => {
            const shown = document.getElementById("frame").contentDocument.querySelector("photo-3d");
            const { contexts, photos } = shown.constructor.statistics();
            return { contexts, photos, caption: shown.caption, width: shown.getAttribute("width") };
        });
        assert.deepEqual(found, { contexts: 1, photos: 1, caption: "turned", width: "1536" });
    });

    await test("on a phone, the page takes a photo with the rear camera", () => openPage(browser, onePage, { isPhone: true }), async (page) => {
        assert.equal(await page.$eval("#prompt", (prompt) => prompt.textContent), "Choose or take a photo");
        const chosen = page.waitForFileChooser();
        await page.click("#camera");
        await (await chosen).accept([sample]);
        assert.match((await waitForResult(page)).status, /^sample is ready/);
        assert.equal(await page.$eval("#camera-file", (input) => input.getAttribute("capture")), "environment");
    });

    await test("the page shows the progress of each stage, in order", open(), async (page) => {
        await page.evaluate(() => {
            window.progress = [];
            const stage = document.getElementById("stage");
            const bar = document.getElementById("progress");
            new MutationObserver(() => window.progress.push([stage.textContent, bar.value])).observe(bar, { attributes: true });
        });
        await choose(page, sample);
        const progress = await page.evaluate(() => window.progress);
        assert.deepEqual([...new Set(progress.map(([stage]) => stage))], [
            "Loading the networks", "Reading the photo", "Estimating depth", "Cleaning depth", "Growing hidden surfaces", "Coloring hidden surfaces",
            "Cutting the surfaces", "Packing the texture", "Building the mesh", "Writing the file", "Opening the 3D photo",
        ]);
        const values = progress.map(([, value]) => value);
        assert.deepEqual(values, [...values].sort((a, b) => a - b), "the progress bar never moves back");
        assert.equal(values.at(-1), 1);
    });

    await test("the page shares the 3D photo as a file, and the viewer does not offer the address of its frame", open(), async (page) => {
        await page.evaluate(() => {
            navigator.canShare = ({ files }) => files.length === 1;
            navigator.share = async ({ files }) => {
                window.given = { name: files[0].name, text: await files[0].text(), isAllowed: navigator.userActivation.isActive };
            };
        });
        await choose(page, sample);
        const isOffered = await page.evaluate(() => {
            const { shadowRoot } = document.getElementById("frame").contentDocument.querySelector("photo-3d");
            return ["reset", "share"].map((id) => !shadowRoot.getElementById(id).hidden);
        });
        assert.deepEqual(isOffered, [true, false]);
        await page.click("#share");
        await page.waitForFunction(() => window.given);
        const { name, text, isAllowed } = await page.evaluate(() => window.given);
        assert.equal(name, "sample.html");
        assert.match(text, /<photo-3d standalone caption="sample"/);
        assert.ok(isAllowed, "the share sheet opens at the click");
        await page.evaluate(() => (navigator.share = () => Promise.reject(new Error("No program accepts the file."))));
        await page.click("#share");
        await page.waitForFunction(() => document.getElementById("error").textContent === "No program accepts the file.");
    });

    await test("the page cannot send data", open(), async (page) => {
        const isSent = await page.evaluate(async () => {
            const attempts = [
                () => fetch("https://example.org/", { method: "POST", body: "photo", mode: "no-cors" }),
                () => new Promise((resolve, reject) => Object.assign(new Image(), { src: "https://example.org/?photo", onload: resolve, onerror: reject })),
                () => new Promise((resolve, reject) => Object.assign(new WebSocket("wss://example.org/"), { onopen: resolve, onerror: reject })),
            ];
            return Promise.all(attempts.map((attempt) => Promise.resolve().then(attempt).then(() => true, () => false)));
        });
        assert.deepEqual(isSent, [false, false, false]);
        assert.ok(page.errors.some((line) => /Content Security Policy/.test(line)), "the policy refuses the requests, not the network");
        page.errors = [];
    });

    await test("the page fits phones in portrait, in landscape and in dark mode", open({ width: 360, height: 640, features: [{ name: "prefers-color-scheme", value: "dark" }] }), async (page) => {
        await page.screenshot({ path: join(made, "phone_empty.png") });
        await choose(page, sample);
        for (const [name, width, height] of [["upright", 360, 640], ["lying", 740, 360]]) {
            await page.setViewport({ width, height });
            await new Promise((resolve) => setTimeout(resolve, 600));
            await page.screenshot({ path: join(made, `phone_${name}.png`) });
            assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), true, "nothing is wider than the screen");
        }
    });

    await test("axe-core reports no violation before and after a conversion", open(), async (page) => {
        const axe = await readFile(join(here, "node_modules/axe-core/axe.min.js"), "utf8");
        const findings = async () => {
            await page.evaluate(axe);
            const { violations } = await page.evaluate(() => window.axe.run(document, { iframes: false }));
            return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(", ")}`);
        };
        assert.deepEqual(await findings(), []);
        await choose(page, sample);
        assert.deepEqual(await findings(), []);
    });

    await test("the converter uses at most 150 MB of memory, even after many photos", open(), async (page) => {
        const heaps = [];
        for (let i = 0; i < 4; ++i) await convert(page, "sample.jpg", sampleBytes);
        for (let i = 0; i < 6; ++i) heaps.push((await convert(page, "sample.jpg", sampleBytes)).facts.heap);
        console.log(`        ${(heaps.at(-1) / 1e6).toFixed(0)} MB`);
        assert.equal(heaps.at(-1), heaps[0]);
        assert.ok(heaps[0] <= 150e6);
    });

    await test("after an error that ends its Worker, the page reports it and converts the next photo", () => openPage(browser, onePage), async (page) => {
        const failure = await page.evaluate(async (content) => {
            const bytes = Uint8Array.from(atob(content), (c) => c.charCodeAt(0));
            const { converter } = window.photo3d;
            const converting = converter.convert(bytes, "sample.jpg", () => {});
            converter.worker.postMessage(null); // which the Worker can't read
            return converting.then(() => "none", ({ message }) => message);
        }, sampleBytes.toString("base64"));
        assert.match(failure, /null/);
        const trap = await page.evaluate(async (content) => {
            const bytes = Uint8Array.from(atob(content), (c) => c.charCodeAt(0));
            const { converter } = window.photo3d;
            await converter.convert(bytes, "sample.jpg", () => {});
            const { worker } = converter;
            const converting = converter.convert(bytes, "sample.jpg", (stage) => {
                if (stage === "depth estimation") worker.onmessage({ data: { id: converter.lastId, failure: "unreachable", isBroken: true } }); // as after a trap in WebAssembly
            });
            return [await converting.then(() => "none", ({ message }) => message), converter.ready];
        }, sampleBytes.toString("base64"));
        assert.deepEqual(trap, ["unreachable", null]);
        assert.ok((await convert(page, "sample.jpg", sampleBytes)).glb.length > 0);
        page.errors.length = 0; // browsers also report the Worker's error on their consoles
    });

    const isolating = await serve(site, isolation);
    await test("on a server that isolates the page, the page uses threads and writes the same bytes", () => openPage(browser, isolating.address), async (page) => {
        assert.ok(await hasAllThreads(page));
        const alone = await openPage(browser, onePage);
        assert.equal((await alone.evaluate(() => window.photo3d.converter.ready)).threads, 1);
        for (const name of ["photo.png", "beside.png"]) {
            const bytes = await readFile(join(made, name));
            assert.ok((await convert(page, name, bytes)).glb.equals((await convert(alone, name, bytes)).glb), name);
        }
        await alone.close();
        const { error } = await choose(page, join(made, "cut.png"));
        assert.match(error, /cut\.png/, "an error in a thread reaches the page");
    });
    await isolating.stop();

    const withHeic = await serve(site);
    await test("on a server, the page reads HEIC photos and their depth like the program, online and offline", () => openPage(browser, withHeic.address), async (page) => {
        assert.deepEqual(page.requests.filter((url) => /heic/.test(url)), [], "the reader is not fetched before it is needed");
        execFileSync("heif-enc", [sample, "-o", join(made, "plain.heic")], { stdio: "ignore" });
        assert.equal((await assertEqualsProgram(page, "plain.heic")).facts.depthSource, "");
        const ofPhone = await readFile(join(top, "../shared/depth_companions/iphone_portrait_pug.heic")).catch(() => null);
        if (ofPhone) {
            await writeFile(join(made, "phone.heic"), ofPhone);
            assert.equal((await assertEqualsProgram(page, "phone.heic")).facts.depthSource, "HEIC disparity");
        }
        await writeFile(join(made, "cut.heic"), (await readFile(join(made, "plain.heic"))).subarray(0, 5000));
        const { error } = await choose(page, join(made, "cut.heic"));
        assert.equal(error.replaceAll("\n", "\\x0A"), messageOfProgram("cut.heic"), "the program escapes the line ends of libheif's messages");
        await page.evaluate(() => navigator.serviceWorker.ready);
        await page.reload(); // now the service worker responds, and caches the reader
        assert.equal((await choose(page, join(made, "plain.heic"))).error, undefined);
        await withHeic.stop();
        await page.reload();
        assert.equal((await choose(page, join(made, "plain.heic"))).error, undefined);
        page.errors = page.errors.filter((line) => !/ERR_CONNECTION_REFUSED/.test(line));
    });

    const unpacking = await serve(site, (name) => (name.endsWith(".gz") ? { "content-encoding": "gzip" } : {}));
    await test("the page works on a server whose .gz files the browser unpacks itself", () => openPage(browser, unpacking.address), async (page) => {
        assert.equal((await choose(page, sample)).error, undefined);
        await page.evaluate(() => navigator.serviceWorker.ready);
        await page.reload(); // now the service worker responds
        assert.equal((await choose(page, sample)).error, undefined);
    });
    await unpacking.stop();

    const renewed = join(made, "site");
    await cp(site, renewed, { recursive: true });
    const caching = await serve(renewed, { "cache-control": "max-age=86400" });
    await test("a new version of the page replaces all files, even those that the browser's own cache has", () => openPage(browser, caching.address), async (page) => {
        await page.waitForFunction(() => navigator.serviceWorker.controller !== null);
        await writeFile(join(renewed, "other.html"), "<!doctype html><title>Other</title>");
        const other = await browser.newPage();
        await other.goto(`${caching.address}other.html`);
        assert.equal(await other.evaluate(() => crossOriginIsolated), false, "the service worker leaves other pages alone");
        await other.close();
        const change = async (name, from, to) => writeFile(join(renewed, name), (await readFile(join(renewed, name), "utf8")).replace(from, to));
        await change("index.html", "</title>", " 2</title>");
        await change("offline.js", /"[0-9a-f]{16}"/, '"2"');
        await page.evaluate(async () => {
            const changed = new Promise((resolve) => navigator.serviceWorker.addEventListener("controllerchange", resolve));
            await (await navigator.serviceWorker.ready).update();
            await changed;
        });
        await page.reload();
        assert.match(await page.title(), / 2$/);
    });
    await caching.stop();

    let isLost = true;
    const losing = await serve(site, {}, (name) => name === "/viewer.html.gz" && isLost);
    await test("if the viewer can't be loaded, the page says so, and loads it for the next photo", () => openPage(browser, losing.address), async (page) => {
        assert.match((await choose(page, sample)).error, /viewer\.html/);
        isLost = false;
        assert.equal((await choose(page, sample)).error, undefined);
        await isInMotion(page);
        page.errors = page.errors.filter((line) => !/404/.test(line));
    });
    await losing.stop();

    const server = await serve(site);
    await test("the page works on a server, and offline after the first visit", () => openPage(browser, server.address), async (page) => {
        assert.equal((await choose(page, sample)).error, undefined);
        assert.deepEqual(page.requests.filter((url) => !url.startsWith(server.address)), [], "only the server's own files");
        const names = [...new Set(page.requests)].map((url) => new URL(url).pathname.replace(/\/$/, "/index.html"));
        const sizes = await Promise.all(names.map(async (name) => (await stat(join(site, name))).size));
        const download = sizes.reduce((sum, size) => sum + size, 0);
        console.log(`        a download of ${(download / 1e6).toFixed(2)} MB`);
        assert.ok(names.includes("/converter.wasm.gz") && download <= 3.2e6, `${download} bytes: ${names}`);
        await page.evaluate(() => navigator.serviceWorker.ready);
        assert.equal((await page.evaluate(() => window.photo3d.converter.ready)).threads, 1);
        const pages = server.sent.filter((name) => name === "/index.html");
        const others = server.sent.filter((name) => name !== "/index.html" && name !== "/offline.js");
        assert.ok(pages.length <= 2 && new Set(others).size === others.length, `each file is sent once: ${others}`);
        await server.stop();
        await page.reload();
        assert.equal(await page.evaluate(() => crossOriginIsolated), true, "the service worker isolates the page");
        assert.ok(await hasAllThreads(page));
        assert.equal((await choose(page, sample)).error, undefined);
        page.errors = page.errors.filter((line) => !/ERR_CONNECTION_REFUSED/.test(line));
    });
}

/** Whether the converter has a thread for every processor, up to 8. */
function hasAllThreads(page) {
    return page.evaluate(async () => (await window.photo3d.converter.ready).threads === Math.min(navigator.hardwareConcurrency, 8));
}

/** Returns a picture as JPEG, encoded by the browser. */
function jpegOf(page, picture) {
    return page.evaluate(async (content) => {
        const decoded = await createImageBitmap(new Blob([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))]));
        const canvas = new OffscreenCanvas(decoded.width, decoded.height);
        canvas.getContext("2d").drawImage(decoded, 0, 0);
        const bytes = new Uint8Array(await (await canvas.convertToBlob({ type: "image/jpeg", quality: 0.95 })).arrayBuffer());
        return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
    }, picture.toString("base64"));
}

/** Returns a PNG with the sample on the left and a gray map on the right, nearer at the bottom. */
function besideDepth(page) {
    return page.evaluate(async (content) => {
        const picture = await createImageBitmap(new Blob([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))]));
        const canvas = new OffscreenCanvas(576, 384);
        const context = canvas.getContext("2d");
        context.drawImage(picture, 0, 0, 288, 384);
        for (let y = 0; y < 384; ++y) {
            const gray = Math.round(40 + y / 4) + (y > 200 ? 60 : 0);
            context.fillStyle = `rgb(${gray} ${gray} ${gray})`;
            context.fillRect(288, y, 288, 1);
        }
        const bytes = new Uint8Array(await (await canvas.convertToBlob({ type: "image/png" })).arrayBuffer());
        return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
    }, sampleBytes.toString("base64"));
}

tests.end();
