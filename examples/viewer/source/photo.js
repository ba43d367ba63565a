// Reads a GLB file, and computes the photo's camera and the distances of the nearest and the farthest surface.

import { Box3, Group, Matrix4, Vector3 } from "three";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { readBudget } from "./budget.js";
import { checkGlb } from "./check_glb.js";

/**
 * A model in the space of the camera that took the photo: the camera at the origin, looking along -z, y up.
 *
 * @typedef {object} Photo
 * @property {Group} model
 * @property {number} aspect  the photo's width / height
 * @property {number} halfHeight  half the photo's height at distance 1: the tangent of half the vertical field of view
 * @property {number} nearest  distance of the nearest surface along the optical axis
 * @property {number} farthest  distance of the farthest surface
 * @property {boolean} fillsView  true for photos; false for other models, around which the background is visible
 * @property {boolean} isPastFrame  whether surfaces continue past the photo's border, as far as motion within the budget uncovers them
 * @property {import("./budget.js").Budget | null} budget  motion limits; null if the file has none
 * @property {number} interest  horizontal center of interest: -1 is the photo's left border, 1 its right border
 */

/**
 * @param {ArrayBuffer | Uint8Array} bytes  a GLB file
 * @returns {Promise<Photo>}
 */
export async function readPhoto(bytes) {
    if (ArrayBuffer.isView(bytes)) bytes = new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength).slice().buffer;
    else if (!(bytes instanceof ArrayBuffer)) bytes = new Uint8Array(bytes).slice().buffer; // of another frame
    checkGlb(bytes);
    const file = await parse(bytes);
    const model = new Group();
    model.add(file.scene);
    file.scene.updateWorldMatrix(true, true);

    const photoCamera = file.cameras.find((candidate) => candidate.isPerspectiveCamera);
    const camera = photoCamera ?? cameraThatSeesAll(file.scene);
    const toCamera = new Matrix4().copy(camera.matrixWorld).invert();
    file.scene.applyMatrix4(toCamera);
    model.updateMatrixWorld(true);

    const { nearest, farthest } = depthRange(model);
    const halfHeight = Math.tan((camera.fov * Math.PI) / 360);
    const halfWidth = halfHeight * camera.aspect;
    const budget = readBudget(file.scene.userData, halfWidth, halfHeight);
    const isPastFrame = photoCamera !== undefined && budget !== null && file.scene.userData.past_frame === true;
    const fillsView = camera.fillsView ?? true;
    const interest = fillsView ? middleOfInterest(model, halfWidth, halfHeight, 1 / farthest) : 0;
    return { model, aspect: camera.aspect, halfHeight, nearest, farthest, fillsView, isPastFrame, budget, interest };
}

async function parse(bytes) {
    try {
        const file = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).parseAsync(bytes, "");
        await requireTextures(file.parser);
        return file;
    } catch (failure) {
        throw new Error(`It is broken: ${failure.message}`);
    }
}

/** Throws if the browser can't decode a texture. The loader only logs this, and the surface would be white. */
async function requireTextures(parser) {
    const isTextured = ({ pbrMetallicRoughness }) => pbrMetallicRoughness?.baseColorTexture !== undefined;
    for (const [index, material] of (parser.json.materials ?? []).entries())
        if (isTextured(material) && !(await parser.getDependency("material", index)).map) throw new Error("a texture can't be decoded.");
}

/** Frees a photo's graphics memory. @param {Photo} photo */
export function disposeOf(photo) {
    photo.model.traverse((part) => {
        part.geometry?.dispose();
        for (const material of [part.material ?? []].flat()) {
            for (const value of Object.values(material)) {
                if (!value?.isTexture) continue;
                value.dispose();
                value.image?.close?.(); // closes the decoded picture instead of waiting for garbage collection
            }
            material.dispose();
        }
    });
}

/** Calls `visit` with every vertex of every mesh, in world coordinates. */
function forEachVertex(model, visit) {
    const vertex = new Vector3();
    model.traverse((part) => {
        const positions = part.isMesh ? part.geometry.attributes.position : undefined;
        for (let i = 0; i < (positions?.count ?? 0); ++i) visit(vertex.fromBufferAttribute(positions, i).applyMatrix4(part.matrixWorld));
    });
}

/** Returns the distances of the nearest and the farthest vertex in front of the camera. Vertices behind it are invisible. */
function depthRange(model) {
    let nearest = Infinity;
    let farthest = 0;
    forEachVertex(model, ({ z }) => {
        if (z < 0) {
            nearest = Math.min(nearest, -z);
            farthest = Math.max(farthest, -z);
        }
    });
    if (!(farthest > 0 && farthest < Infinity)) throw new Error("It shows nothing in front of its camera.");
    // A flat model gets a minimum depth range.
    return { nearest, farthest: Math.max(farthest, nearest * 1.001) };
}

/** Maximum aspect ratio of a model without a camera, as in check_glb.js. */
const maxAspect = 20;

/** Rows and columns of the grid in which middleOfInterest() looks for near surfaces. */
const interestCells = 32;

/**
 * Weight of the photo's middle: if surfaces stand out from their row by this share of the disparity range on average, the center of
 * interest moves half the way from the middle to them.
 */
const interestInMiddle = 0.015;

/**
 * Returns the horizontal center, -1 to 1, of the surfaces that stand out from their row of the photo. A floor, which is near along its
 * whole row, does not stand out.
 *
 * @param {number} least  the disparity of the farthest surface
 */
function middleOfInterest(model, halfWidth, halfHeight, least) {
    const cells = interestCells;
    const rows = Array.from({ length: cells }, () => []); // the largest disparity in each cell that has a vertex
    let most = least;
    forEachVertex(model, ({ x, y, z }) => {
        const column = Math.floor((0.5 - x / z / halfWidth / 2) * cells);
        const row = rows[Math.floor((0.5 - y / z / halfHeight / 2) * cells)];
        if (!(z < 0) || !row || column < 0 || column >= cells) return;
        row[column] = Math.max(row[column] ?? least, -1 / z);
        most = Math.max(most, row[column]);
    });
    let [sum, moment, count] = [0, 0, 0];
    for (const row of rows) {
        const sorted = row.filter((disparity) => disparity).sort((a, b) => a - b);
        const usual = sorted[sorted.length >> 1];
        count += sorted.length;
        row.forEach((disparity, column) => {
            const weight = Math.max(disparity - usual, 0);
            sum += weight;
            moment += weight * ((2 * column + 1) / cells - 1);
        });
    }
    const all = count * (most - least);
    return all > 0 ? moment / (sum + interestInMiddle * all) : 0;
}

/**
 * Returns a camera for a file without one. A model that lies in front of the origin is a photo, so its camera is at the origin. Any other
 * model gets a camera in front of it.
 */
function cameraThatSeesAll(scene) {
    const box = new Box3().setFromObject(scene);
    if (box.isEmpty()) throw new Error("It shows nothing.");
    const size = box.getSize(new Vector3());
    const matrixWorld = new Matrix4();
    let halfWidth = 0;
    let halfHeight = 0;
    const fillsView = box.max.z < 0;
    if (fillsView) {
        forEachVertex(scene, ({ x, y, z }) => {
            halfWidth = Math.max(halfWidth, Math.abs(x / z));
            halfHeight = Math.max(halfHeight, Math.abs(y / z));
        });
    } else {
        const distance = 1.5 * size.length();
        const center = box.getCenter(new Vector3());
        matrixWorld.makeTranslation(center.x, center.y, box.max.z + distance);
        halfWidth = (0.6 * size.x) / distance;
        halfHeight = (0.6 * size.y) / distance;
    }
    halfWidth = Math.max(halfWidth, 1e-3);
    halfHeight = Math.max(halfHeight, 1e-3, halfWidth / maxAspect);
    halfWidth = Math.max(halfWidth, halfHeight / maxAspect);
    return { matrixWorld, fov: (Math.atan(halfHeight) * 360) / Math.PI, aspect: halfWidth / halfHeight, fillsView };
}
