// Small changes to GLB files, for tests of files that photo3d did not write.

/** @param {Buffer} glb @returns {{json: object, binary: Buffer}} */
export function takeApart(glb) {
    const jsonLength = glb.readUInt32LE(12);
    const binaryStart = 20 + jsonLength;
    const binary = glb.subarray(binaryStart + 8, binaryStart + 8 + glb.readUInt32LE(binaryStart));
    return { json: JSON.parse(glb.toString("utf8", 20, binaryStart)), binary };
}

/** @returns {Buffer} a GLB file */
export function putTogether({ json, binary }) {
    const text = Buffer.from(JSON.stringify(json));
    const chunk = (type, content, fill) => {
        const padding = Buffer.alloc((4 - (content.length % 4)) % 4, fill);
        const head = Buffer.alloc(8);
        head.writeUInt32LE(content.length + padding.length, 0);
        head.write(type, 4, "latin1");
        return Buffer.concat([head, content, padding]);
    };
    const body = Buffer.concat([chunk("JSON", text, " "), chunk("BIN\0", binary, 0)]);
    const head = Buffer.alloc(12);
    head.write("glTF", 0, "latin1");
    head.writeUInt32LE(2, 4);
    head.writeUInt32LE(12 + body.length, 8);
    return Buffer.concat([head, body]);
}

/** Returns the file without its camera. */
export function withoutCamera(glb) {
    const { json, binary } = takeApart(glb);
    delete json.cameras;
    for (const node of json.nodes) delete node.camera;
    return putTogether({ json, binary });
}

/** Returns the file without compression and without every `step`-th triangle. */
export function withHoles(glb, step) {
    const { json, binary } = takeApart(glb);
    const { count, componentType, bufferView, byteOffset = 0 } = json.accessors[json.meshes[0].primitives[0].indices];
    const indices = new { 5123: Uint16Array, 5125: Uint32Array }[componentType](count);
    const bytes = new Uint8Array(indices.buffer);
    const begin = (json.bufferViews[bufferView].byteOffset ?? 0) + byteOffset;
    binary.copy(bytes, 0, begin);
    for (let i = 0; i < count; i += 3 * step) indices.fill(indices[i], i, i + 3);
    const changed = Buffer.from(binary);
    changed.set(bytes, begin);
    return putTogether({ json, binary: changed });
}

/**
 * Returns a file that is not a photo: a white square of 2 x 2 around the origin, without a camera.
 *
 * @param {number} [angle]  rotation in the picture's plane, in radians
 */
export function square(angle = 0) {
    const corner = (x, y) => [x * Math.cos(angle) - y * Math.sin(angle), x * Math.sin(angle) + y * Math.cos(angle), 0];
    const [a, b, c, d] = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
    const positions = Buffer.from(new Float32Array([a, b, c, a, c, d].flat()).buffer);
    const reach = Math.abs(Math.cos(angle)) + Math.abs(Math.sin(angle));
    const json = {
        asset: { version: "2.0" },
        scene: 0,
        scenes: [{ nodes: [0] }],
        nodes: [{ mesh: 0 }],
        meshes: [{ primitives: [{ attributes: { POSITION: 0 }, material: 0 }] }],
        materials: [{ extensions: { KHR_materials_unlit: {} } }],
        accessors: [{ bufferView: 0, componentType: 5126, count: 6, type: "VEC3", min: [-reach, -reach, 0], max: [reach, reach, 0] }],
        bufferViews: [{ buffer: 0, byteLength: positions.length }],
        buffers: [{ byteLength: positions.length }],
        extensionsUsed: ["KHR_materials_unlit"],
    };
    return putTogether({ json, binary: positions });
}

/** Returns a photo, twice as wide as high: a gray wall, and a narrow white sheet in front of it right of the middle. */
export function besideMiddle() {
    const positions = [];
    // A sheet of cells x cells squares that fills the rectangle of the picture.
    const sheet = (left, right, bottom, top, distance, cells) => {
        const begin = positions.length / 3;
        const at = (column, row) => [left + ((right - left) * column) / cells, bottom + ((top - bottom) * row) / cells];
        const add = (...corners) => corners.forEach(([x, y]) => positions.push(2 * x * distance, y * distance, -distance));
        for (let row = 0; row < cells; ++row)
            for (let column = 0; column < cells; ++column) {
                const [a, b, c, d] = [at(column, row), at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)];
                add(a, b, c, a, c, d);
            }
        return { byteOffset: 12 * begin, count: positions.length / 3 - begin };
    };
    const parts = [sheet(-1, 1, -1, 1, 5, 24), sheet(0.5, 0.7, -0.8, 0.8, 2, 12)];
    const binary = Buffer.from(new Float32Array(positions).buffer);
    const json = {
        asset: { version: "2.0" },
        scene: 0,
        scenes: [{ nodes: [0, 1] }],
        nodes: [{ mesh: 0 }, { camera: 0 }],
        cameras: [{ type: "perspective", perspective: { aspectRatio: 2, yfov: Math.PI / 2, znear: 0.1 } }],
        meshes: [{ primitives: parts.map((_, i) => ({ attributes: { POSITION: i }, material: i })) }],
        materials: [0.1, 1].map((gray) => ({ pbrMetallicRoughness: { baseColorFactor: [gray, gray, gray, 1] }, extensions: { KHR_materials_unlit: {} } })),
        accessors: parts.map((part) => ({ bufferView: 0, componentType: 5126, type: "VEC3", min: [-10, -5, -5], max: [10, 5, -2], ...part })),
        bufferViews: [{ buffer: 0, byteLength: binary.length }],
        buffers: [{ byteLength: binary.length }],
        extensionsUsed: ["KHR_materials_unlit"],
    };
    return putTogether({ json, binary });
}
