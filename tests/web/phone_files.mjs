// Writes JPEG files that contain a depth map, in the formats of phones. tests/io/phone_files.hpp writes the same formats.

import { deflateSync } from "node:zlib";

/** Checksum of PNG chunks; node:zlib has one only since version 22. @param {Buffer} bytes */
export function crc32(bytes) {
    let rest = -1;
    for (const byte of bytes) {
        rest ^= byte;
        for (let bit = 0; bit < 8; ++bit) rest = (rest >>> 1) ^ (rest & 1 ? 0xedb88320 : 0);
    }
    return ~rest >>> 0;
}

const bigEndian = (value, size) => Buffer.from(Array.from({ length: size }, (_, i) => (value >>> (8 * (size - 1 - i))) & 255));

/** Returns a gray PNG. @param {(y: number, x: number) => number} valueAt  0 to 255 */
export function grayPng(height, width, valueAt) {
    const rows = Buffer.alloc(height * (width + 1)); // each row begins with its filter: none
    for (let y = 0; y < height; ++y) for (let x = 0; x < width; ++x) rows[y * (width + 1) + 1 + x] = valueAt(y, x);
    const chunk = (name, body) => {
        const named = Buffer.concat([Buffer.from(name), body]);
        return Buffer.concat([bigEndian(body.length, 4), named, bigEndian(crc32(named), 4)]);
    };
    const header = Buffer.concat([bigEndian(width, 4), bigEndian(height, 4), Buffer.from([8, 0, 0, 0, 0])]);
    return Buffer.concat([Buffer.from("\x89PNG\r\n\x1a\n", "latin1"), chunk("IHDR", header), chunk("IDAT", deflateSync(rows)), chunk("IEND", Buffer.alloc(0))]);
}

const segment = (marker, body) => Buffer.concat([Buffer.from([0xff, marker]), bigEndian(body.length + 2, 2), body]);
const withSegments = (jpeg, segments) => Buffer.concat([jpeg.subarray(0, 2), segments, jpeg.subarray(2)]);

const xmpSegment = (attributes, children = "") =>
    segment(
        0xe1,
        Buffer.from(
            `http://ns.adobe.com/xap/1.0/\0<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">` +
                `<rdf:Description rdf:about="" ${attributes}>${children}</rdf:Description></rdf:RDF></x:xmpmeta>`,
        ),
    );

/** GDepth: the depth map as text in the XMP. */
export const withGdepth = (photo, depth, format = "RangeInverse") =>
    withSegments(
        photo,
        xmpSegment(
            `xmlns:GDepth="http://ns.google.com/photos/1.0/depthmap/" GDepth:Format="${format}" GDepth:Near="1.25" GDepth:Far="8e0" ` +
                `GDepth:Units="m" GDepth:Data="${depth.toString("base64")}"`,
        ),
    );

/** Dynamic Depth: the depth map behind the photo, in a directory in the XMP. */
export const withDynamicDepth = (photo, depth) =>
    Buffer.concat([
        withSegments(
            photo,
            xmpSegment(
                `xmlns:Container="http://ns.google.com/photos/dd/1.0/container/" xmlns:Item="http://ns.google.com/photos/dd/1.0/item/" ` +
                    `xmlns:DepthMap="http://ns.google.com/photos/dd/1.0/depthmap/"`,
                `<DepthMap:Map DepthMap:Format="RangeLinear" DepthMap:Near="1" DepthMap:Far="6" DepthMap:DepthURI="android/depthmap"/>` +
                    `<Container:Directory><rdf:Seq><rdf:li><Container:Item Item:Mime="image/jpeg" Item:Semantic="Primary" Item:Length="0"/></rdf:li>` +
                    `<rdf:li><Container:Item Item:Mime="image/jpeg" Item:Semantic="Depth" Item:DataURI="android/depthmap" Item:Length="${depth.length}"/></rdf:li>` +
                    `</rdf:Seq></Container:Directory>`,
            ),
        ),
        depth,
    ]);

/** Apple's format: the depth map is a second picture in the file, with its own XMP. */
export function withAppleDepth(photo, depthJpeg) {
    const depth = withSegments(
        depthJpeg,
        xmpSegment(
            `xmlns:apdi="http://ns.apple.com/pixeldatainfo/1.0/" apdi:AuxiliaryImageType="disparity" apdi:FloatMinValue="0.25" apdi:FloatMaxValue="1.5"`,
        ),
    );
    // A directory with one entry: the list of pictures, 16 bytes each.
    const list = (at) =>
        Buffer.concat([
            Buffer.from("MPF\0MM\0*\0\0\0\x08\0\x01", "latin1"),
            Buffer.concat([bigEndian(0xb002, 2), bigEndian(7, 2), bigEndian(32, 4), bigEndian(26, 4), bigEndian(0, 4)]),
            Buffer.alloc(16),
            Buffer.concat([bigEndian(0, 4), bigEndian(depth.length, 4), bigEndian(at, 4), bigEndian(0, 4)]),
        ]);
    const length = withSegments(photo, segment(0xe2, list(0))).length;
    const origin = 2 + 4 + 4; // bytes before the origin of positions: the file's first marker, the marker and length of the segment, and "MPF"
    return Buffer.concat([withSegments(photo, segment(0xe2, list(length - origin))), depth]);
}
