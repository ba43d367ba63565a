// node photographs.mjs FOLDER [PICTURES]: counts the gaps in all pages of a folder, at all positions of the viewer. A page fails if any
// pixel changes with the clear color. Writes the view with the most gaps in the mesh to the folder PICTURES, with and without the backdrop.
// Ends with "N passed, N failed".

import { mkdir, readdir } from "node:fs/promises";
import { join } from "node:path";
import { openPhoto, startBrowser } from "./browser.mjs";
import { clearColorScript, countGaps, goTo, places } from "./gaps.mjs";

const [folder, pictures] = process.argv.slice(2);
const pages = (await readdir(folder)).filter((name) => name.endsWith(".html")).sort();
const { context, stop } = await startBrowser();
let [passed, failed, withGaps] = [0, 0, 0];
for (const name of pages) {
    const page = await openPhoto(context, join(folder, name), { reducedMotion: true, size: { width: 1000, height: 800 }, scripts: [clearColorScript] });
    const most = { mesh: -1, backdrop: 0, place: places[0] };
    for (const place of places) {
        await goTo(page, place);
        const mesh = await countGaps(page, false);
        if (mesh > most.mesh) Object.assign(most, { mesh, place });
        most.backdrop = Math.max(most.backdrop, await countGaps(page, true));
    }
    if (pictures && most.mesh > 0) {
        await mkdir(pictures, { recursive: true });
        await goTo(page, most.place);
        for (const hasBackdrop of [false, true]) {
            await countGaps(page, hasBackdrop);
            const file = join(pictures, name.replace(".html", hasBackdrop ? "_on.png" : "_off.png"));
            await page.locator("photo-3d #photo").screenshot({ path: file });
        }
    }
    const isClosed = most.backdrop === 0 && page.errors.length === 0;
    isClosed ? (passed += 1) : (failed += 1);
    withGaps += most.mesh > 0 ? 1 : 0;
    console.log(`${isClosed ? "passed" : "FAILED"}: ${name}: at most ${most.backdrop} gap pixels, ${most.mesh} without the backdrop ${page.errors.join(", ")}`);
    await page.close();
}
await stop();
console.log(`${withGaps} of ${pages.length} meshes have a gap somewhere`);
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed === 0 && passed > 0 ? 0 : 1);
