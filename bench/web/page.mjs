// node page.mjs ROUNDS: times examples/web in Chromium and Firefox. Each round opens the page, waits until its warm-up ends, and converts
// the sample (1152 x 1536) five times. Then it opens the page again and converts at once. Prints medians; the last number is Chromium's for
// the photos after the first, in milliseconds. On a busy machine, rely on the processor time, which is the sum over all processes of the
// browser.

import { readdir, readFile, stat } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { convert, openPage, startBrowser } from "../../tests/web/browsers.mjs";

const top = join(dirname(fileURLToPath(import.meta.url)), "../..");
const rounds = Number(process.argv[2] ?? 5);
const sample = await readFile(join(top, "examples/photo3d/sample.jpg"));
const site = join(top, "build/web/site");
const address = pathToFileURL(join(top, "build/web/photo3d.html")).href;

const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];
const print = (name, value, unit = "ms") => console.log(`${name.padEnd(44)} ${value.toFixed(0).padStart(7)} ${unit}`);

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
    const times = { ready: [], warm: [], cold: [], first: [], next: [], firstProcessor: [], nextProcessor: [] };
    const stages = {};
    let heap = 0;
    for (let round = 0; round < rounds; ++round) {
        const browser = await startBrowser(kind);
        const page = await openPage(browser, address);
        times.ready.push((await page.evaluate(() => window.photo3d.converter.ready)).milliseconds);
        times.warm.push((await page.evaluate(() => window.photo3d.converter.warm)).milliseconds);
        for (let i = 0; i < 5; ++i) {
            const before = await processorTime(browser.process().pid);
            const { milliseconds, facts } = await convert(page, "sample.jpg", sample);
            times[i === 0 ? "first" : "next"].push(milliseconds);
            times[i === 0 ? "firstProcessor" : "nextProcessor"].push((await processorTime(browser.process().pid)) - before);
            heap = Math.max(heap, facts.heap);
            if (i > 0) for (const [stage, time] of Object.entries(facts.stages)) (stages[stage] ??= []).push(time);
        }
        const cold = await openPage(browser, address);
        times.cold.push((await convert(cold, "sample.jpg", sample)).milliseconds);
        await browser.close();
    }
    print(`${kind}: loading the networks`, median(times.ready));
    print(`${kind}: warm-up, until a photo is chosen`, median(times.warm));
    print(`${kind}: first photo, after the warm-up`, median(times.first));
    print("    processor time", median(times.firstProcessor));
    print(`${kind}: first photo, chosen at once`, median(times.cold));
    print(`${kind}: next photo`, median(times.next));
    print("    processor time", median(times.nextProcessor));
    for (const [stage, all] of Object.entries(stages)) print(`    ${stage}`, median(all));
    print(`${kind}: memory of the converter`, heap / 1e6, "MB");
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
