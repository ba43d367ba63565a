// A page that shows our USDZ files with the loader of three.js.

import { writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const viewer = join(dirname(fileURLToPath(import.meta.url)), "../../examples/viewer");
const { build } = createRequire(join(viewer, "package.json"))("esbuild"); // installed by build.sh

const program = `
import { PerspectiveCamera, Scene, WebGLRenderer } from "three";
import { USDLoader } from "three/addons/loaders/USDLoader.js";

/** Shows a USDZ file (base64) from the photo's viewpoint: the origin of the mesh's own coordinates. The file puts the mesh on the floor. */
window.showUsdz = async (base64, { yfov, aspectRatio }) => {
    const model = new USDLoader().parse(Uint8Array.from(atob(base64), (c) => c.charCodeAt(0)).buffer);
    const scene = new Scene().add(model);
    const camera = new PerspectiveCamera((yfov * 180) / Math.PI, aspectRatio, 0.01, 1000);
    model.traverse((part) => {
        if (!part.isMesh) return;
        part.updateWorldMatrix(true, false);
        camera.position.setFromMatrixPosition(part.matrixWorld);
    });
    const renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    renderer.setSize(Math.round(600 * Math.min(aspectRatio, 1)), Math.round(600 / Math.max(aspectRatio, 1)));
    document.body.append(renderer.domElement);
    for (let i = 0; i < 100; ++i) {
        let isLoaded = true;
        model.traverse((part) => (isLoaded &&= !part.isMesh || Boolean(part.material.emissiveMap?.image)));
        if (isLoaded) break;
        await new Promise((resolve) => setTimeout(resolve, 100));
    }
    renderer.render(scene, camera);
};`;

/** @returns {Promise<string>} the path of the page */
export async function makeUsdPage(path) {
    const { outputFiles } = await build({
        stdin: { contents: program, resolveDir: join(viewer, "source") },
        bundle: true,
        write: false,
        format: "iife",
        logLevel: "warning",
    });
    await writeFile(path, `<!doctype html><title>USDZ</title><body style="margin: 0"><script>${outputFiles[0].text.replaceAll("</script", "<\\/script")}</script>`);
    return path;
}
