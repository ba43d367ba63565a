// node page.mjs ROUNDS: times examples/web in Chromium and Firefox, from the choice of a file until the first picture of the turning 3D photo is
// drawn. Each round opens the page, waits until its warm-up ends, and chooses the sample (1152 x 1536) five times. Then it opens the page
// again and chooses the sample at once. Prints medians; the last number is Chromium's for the photos after the first, in milliseconds. On a
// busy machine, rely on the processor time, which is the sum over all processes of the browser. A software renderer draws the 3D photo.

import { readdir, readFile, stat } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { choose, convert, openPage, startBrowser } from "../../tests/web/browsers.mjs";

const top = join(dirname(fileURLToPath(import.meta.url)), "../..");
const rounds = Number(process.argv[2] ?? 5);
const samplePath = join(top, "examples/photo3d/sample.jpg");
const sample = await readFile(samplePath);
const site = join(top, "build/web/site");
const address = pathToFileURL(join(top, "build/web/photo3d.html")).href;

const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];
const print = (name, value, unit = "ms") => console.log(`${name.padEnd(44)} ${value.toFixed(0).padStart(7)} ${unit}`);

/** Opens the page, and makes it record when a file is chosen, when its GLB is ready, and when its 3D photo has been drawn and turns. */
async function openTimed(browser) {
    const page = await openPage(browser, address);
    await page.waitForFunction(() => document.getElementById("frame").contentDocument.querySelector("photo-3d")?.state);
    await page.evaluate(() => {
        const shown = document.getElementById("frame").contentDocument.querySelector("photo-3d");
        const { converter } = window.photo3d;
        const convert = converter.convert.bind(converter);
        let chosen;
        converter.convert = async (...values) => {
            const photo = await convert(...values);
            window.timeUntilGlb = performance.now() - chosen;
            return photo;
        };
        document.getElementById("file").addEventListener("change", () => {
            chosen = performance.now();
            window.timeUntilTurning = new Promise((resolve) => {
                const look = () => {
                    if (shown.state().reach.right !== 0) resolve(performance.now() - chosen);
                    else requestAnimationFrame(look);
                };
                shown.addEventListener("load", look, { once: true });
            });
        }, true);
    });
    return page;
}

/** Chooses the sample, and waits until its 3D photo turns. */
async function time(page) {
    const facts = await choose(page, samplePath);
    const [milliseconds, untilGlb] = await page.evaluate(async () => [await window.timeUntilTurning, window.timeUntilGlb]);
    return { milliseconds, untilGlb, facts };
}

/** Returns the pictures per second of a turning 3D photo, the draw calls per picture, and the memory of the page's JavaScript in bytes. */
function watch(page) {
    return page.evaluate(async () => {
        const seconds = 3;
        const { statistics } = document.getElementById("frame").contentDocument.querySelector("photo-3d").constructor;
        const before = statistics();
        await new Promise((resolve) => setTimeout(resolve, 1000 * seconds));
        const after = statistics();
        const frames = after.frames - before.frames;
        return { rate: frames / seconds, calls: (after.drawings - before.drawings) / frames, heap: performance.memory?.usedJSHeapSize ?? 0 };
    });
}

const isRead = (name) => !/^(converter_threads|heic)[.]/.test(name);
const sizes = await Promise.all((await readdir(site)).filter(isRead).map((name) => stat(join(site, name))));
print("download, one thread", sizes.reduce((sum, { size }) => sum + size, 0) / 1000, "kB");
const results = {};

/** Returns the processor time of a process and all its descendants, in milliseconds. */
async function processorTime(root) {
    const children = new Map();
    const times = new Map();
    for (const id of (await readdir("/proc")).filter((name) => /^[0-9]+$/.test(name))) {
        const text = await readFile(`/proc/${id}/stat`, "latin1").catch(() => null); // the process may have ended
        if (!text) continue;
        const fields = text.slice(text.lastIndexOf(")") + 2).split(" ");
        children.set(fields[1], [...(children.get(fields[1]) ?? []), id]);
        times.set(id, 10 * (Number(fields[11]) + Number(fields[12]))); // the file counts hundredths of a second
    }
    const sum = (id) => (times.get(id) ?? 0) + (children.get(id) ?? []).map(sum).reduce((a, b) => a + b, 0);
    return sum(String(root));
}
for (const kind of ["chromium", "firefox"]) {
    const times = { ready: [], warm: [], cold: [], first: [], next: [], firstGlb: [], nextGlb: [], rate: [], firstProcessor: [], nextProcessor: [] };
    const stages = {};
    let heap = 0;
    let turning;
    for (let round = 0; round < rounds; ++round) {
        const browser = await startBrowser(kind);
        const page = await openTimed(browser);
        times.ready.push((await page.evaluate(() => window.photo3d.converter.ready)).milliseconds);
        times.warm.push((await page.evaluate(() => window.photo3d.converter.warm)).milliseconds);
        for (let i = 0; i < 5; ++i) {
            const before = await processorTime(browser.process().pid);
            const { milliseconds, untilGlb, facts } = await time(page);
            times[i === 0 ? "first" : "next"].push(milliseconds);
            times[i === 0 ? "firstGlb" : "nextGlb"].push(untilGlb);
            times[i === 0 ? "firstProcessor" : "nextProcessor"].push((await processorTime(browser.process().pid)) - before);
            heap = Math.max(heap, facts.heap);
            if (i > 0) for (const [stage, time] of Object.entries(facts.stages)) (stages[stage] ??= []).push(time);
        }
        turning = await watch(page);
        times.rate.push(turning.rate);
        const cold = await openTimed(browser);
        times.cold.push((await time(cold)).milliseconds);
        await browser.close();
    }
    print(`${kind}: loading the networks`, median(times.ready));
    print(`${kind}: warm-up, until a photo is chosen`, median(times.warm));
    print(`${kind}: first photo, after the warm-up`, median(times.first));
    print("    until the GLB is ready", median(times.firstGlb));
    print("    processor time", median(times.firstProcessor));
    print(`${kind}: first photo, chosen at once`, median(times.cold));
    print(`${kind}: next photo`, median(times.next));
    print("    until the GLB is ready", median(times.nextGlb));
    print("    processor time", median(times.nextProcessor));
    for (const [stage, all] of Object.entries(stages)) print(`    ${stage}`, median(all));
    print(`${kind}: memory of the converter`, heap / 1e6, "MB");
    if (turning.heap > 0) print(`${kind}: memory of the page's JavaScript`, turning.heap / 1e6, "MB");
    print(`${kind}: pictures of the turning 3D photo`, median(times.rate), "per second");
    print("    draw calls per picture", turning.calls, "");
    results[kind] = median(times.next);
}
const browser = await startBrowser("chromium");
const page = await openPage(browser, address);
await page.evaluate(() => window.photo3d.converter.warm);
const heaps = [];
for (let i = 0; i < 100; ++i) heaps.push((await convert(page, "sample.jpg", sample)).facts.heap / 1e6);
await browser.close();
for (const count of [1, 5, 10, 100]) print(`chromium: memory after ${count} photos`, heaps[count - 1], "MB");
console.log(`chromium, next photo: ${results.chromium.toFixed(1)}`);
