// Refuses GLB files that need more resources than a photo should, or that refer to other files.

const limits = { nodes: 10_000, values: 60_000_000, side: 16_384, texels: 200_000_000, aspect: 20 };
const components = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16 };

/** Checks a GLB file. Throws an error with a message for users. @param {ArrayBuffer} bytes */
export function checkGlb(bytes) {
    const view = new DataView(bytes);
    if (bytes.byteLength < 20 || view.getUint32(0) !== 0x676c5446) throw new Error("It is not a GLB file."); // "glTF"
    if (view.getUint32(4, true) !== 2) throw new Error("It is a GLB file of a version other than 2.");
    const end = view.getUint32(8, true);
    if (end > bytes.byteLength) throw new Error("The file is incomplete.");
    const length = view.getUint32(12, true);
    if (view.getUint32(16, true) !== 0x4e4f534a || 20 + length > end) throw new Error("It has no JSON."); // "JSON"
    const binary = 28 + length;
    // three.js reads the last chunk of each kind, so only the two that are checked may be there.
    if (binary <= end && (view.getUint32(binary - 4, true) !== 0x004e4942 || binary + view.getUint32(binary - 8, true) !== end)) // "BIN"
        throw new Error("It has other parts than JSON and binary data.");
    if (binary > end && 20 + length !== end) throw new Error("The file is incomplete.");
    let json;
    try {
        json = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 20, length)));
    } catch {
        throw new Error("Its JSON is broken.");
    }
    const list = (name) => (Array.isArray(json?.[name]) ? json[name].map((entry) => entry ?? {}) : []);
    // The checks below read only the binary chunk, so the JSON must not contain files as text.
    if ([...list("buffers"), ...list("images")].some(({ uri }) => uri !== undefined))
        throw new Error("It refers to other files, or has files as text.");
    // Anything but a number of 0 or more counts as infinite, because `+` would append strings to the sum.
    const total = (sizes) => sizes.reduce((sum, size) => sum + (typeof size === "number" && size >= 0 ? size : Infinity), 0);
    const values = total(list("accessors").map(({ count, type }) => count * components[type]));
    const compressed = list("bufferViews").flatMap(({ extensions }) => Object.values(extensions ?? {}));
    const buffered = total(compressed.filter((data) => data?.count !== undefined).map(({ count, byteStride }) => count * byteStride));
    if (!(values <= limits.values && buffered <= 4 * limits.values)) throw new Error("It has too many vertices.");
    // The loader copies every view, and every accessor that an animation uses.
    const viewed = total(list("bufferViews").map(({ byteLength = 0, extensions }) => (extensions?.EXT_meshopt_compression ?? { byteLength }).byteLength ?? 0));
    if (!(viewed <= 2 * bytes.byteLength)) throw new Error("Its views of the binary data overlap too much.");
    if (json.animations !== undefined || json.skins !== undefined) throw new Error("It has animations.");
    if (json.extensions?.KHR_lights_punctual !== undefined || list("extensionsUsed").includes("KHR_lights_punctual")) throw new Error("It has lights.");
    checkCameras(list("cameras"));
    checkMaterials(list("materials"));
    checkNodes(list("nodes"));
    checkMeshes(list("nodes"), list("meshes"), list("accessors"));
    const sizes = sizesOfImages(list("images"), list("bufferViews"), new Uint8Array(bytes, Math.min(binary, end), Math.max(end - binary, 0)));
    // Each texture needs memory on the graphics card, even if several show the same image.
    const sourcesOf = ({ source, extensions }) => [source, ...Object.values(extensions ?? {}).map((other) => other?.source)];
    const shown = list("textures").map((texture) => Math.max(...sourcesOf(texture).map((source) => sizes[source] ?? 0)));
    if (total(shown) > limits.texels) throw new Error("Its textures are too large.");
}

function checkCameras(cameras) {
    for (const { type, perspective } of cameras) {
        if (type !== "perspective") continue;
        const { yfov, aspectRatio = 1 } = perspective ?? {};
        if (!(typeof yfov === "number" && yfov > 0 && yfov < Math.PI)) throw new Error("Its camera's field of view is not between 0 and 180 degrees.");
        if (!(typeof aspectRatio === "number" && aspectRatio >= 1 / limits.aspect && aspectRatio <= limits.aspect))
            throw new Error(`Its camera's aspect ratio is not between 1/${limits.aspect} and ${limits.aspect}.`);
    }
}

/** Refuses extensions that photos do not need. Some of them draw the scene several times. */
function checkMaterials(materials) {
    const other = materials.flatMap(({ extensions }) => Object.keys(extensions ?? {})).find((name) => name !== "KHR_materials_unlit");
    if (other !== undefined) throw new Error(`Its materials need the extension ${other}.`);
}

/** Checks that every node has at most one parent, and that no node is its own ancestor. */
function checkNodes(nodes) {
    if (nodes.length > limits.nodes) throw new Error("It has too many nodes.");
    const parents = new Map();
    for (const [parent, { children }] of nodes.entries())
        for (const child of Array.isArray(children) ? children : []) {
            if (parents.has(child)) throw new Error("Its nodes are not a tree.");
            parents.set(child, parent);
        }
    for (let node = 0; node < nodes.length; ++node)
        for (let [at, depth] = [node, 0]; parents.has(at); at = parents.get(at))
            if (++depth > 64) throw new Error("Its nodes are nested too deeply, or form a cycle.");
}

/** Limits the number of drawn meshes and vertices. Nodes may share meshes, and meshes may share vertices. */
function checkMeshes(nodes, meshes, accessors) {
    const drawn = meshes.map(({ primitives }) => (Array.isArray(primitives) ? primitives : []).map((part) => {
        if (part?.targets !== undefined) throw new Error("It has morph targets.");
        const vertices = accessors[part?.attributes?.POSITION]?.count ?? 0;
        return Math.max(vertices, accessors[part?.indices]?.count ?? 0);
    }));
    let [parts, vertices] = [0, 0];
    for (const { mesh, extensions } of nodes) {
        if (extensions?.EXT_mesh_gpu_instancing !== undefined) throw new Error("It draws a mesh many times (EXT_mesh_gpu_instancing).");
        parts += drawn[mesh]?.length ?? 0;
        if (parts > limits.nodes) throw new Error("It has too many meshes.");
        for (const count of drawn[mesh] ?? []) vertices += count;
    }
    if (!(vertices <= limits.values)) throw new Error("It has too many vertices.");
}

/** Returns the number of texels of each image. */
function sizesOfImages(images, bufferViews, binary) {
    let texels = 0;
    return images.map(({ bufferView }) => {
        const { byteOffset = 0, byteLength = 0, extensions } = bufferViews[bufferView] ?? {};
        if (extensions !== undefined) throw new Error("Its textures are compressed a second time.");
        const size = sizeOfPicture(binary.subarray(byteOffset, byteOffset + byteLength));
        if (size === undefined) throw new Error("Its textures are not PNG, JPEG or WebP pictures.");
        texels += size[0] * size[1];
        if (Math.max(...size) > limits.side || texels > limits.texels) throw new Error("Its textures are too large.");
        return size[0] * size[1];
    });
}

/** Returns the width and height in a PNG, JPEG or WebP file; undefined for other files. */
export function sizeOfPicture(file) {
    const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
    if (file.length >= 30 && view.getUint32(0) === 0x89504e47) return [view.getUint32(16), view.getUint32(20)];
    if (file.length >= 30 && view.getUint32(0) === 0x52494646) {
        const kind = String.fromCharCode(...file.subarray(12, 16));
        const u24 = (at) => view.getUint16(at, true) + 65536 * file[at + 2];
        if (kind === "VP8X") return [1 + u24(24), 1 + u24(27)];
        if (kind === "VP8 ") return [view.getUint16(26, true) & 0x3fff, view.getUint16(28, true) & 0x3fff];
        const sides = view.getUint32(21, true); // 14 bits per side: the side minus 1
        if (kind === "VP8L") return [1 + (sides & 0x3fff), 1 + ((sides >> 14) & 0x3fff)];
    }
    if (file.length >= 4 && view.getUint16(0) === 0xffd8)
        for (let at = 2; at + 9 < file.length && file[at] === 0xff; ) {
            const marker = file[at + 1];
            if (marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker))
                return [view.getUint16(at + 7), view.getUint16(at + 5)];
            at += marker === 0xff ? 1 : 2 + view.getUint16(at + 2); // a marker may follow any number of fill bytes
        }
    return undefined;
}
