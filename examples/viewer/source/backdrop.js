// The backdrop: the photo's farthest surfaces, blurred and continued past the photo's border, behind the whole model. Gaps between surfaces
// show the backdrop instead of the clear color.
//
// The viewer draws the model once, at low resolution, from the photo's camera, with the farthest surface in front. Mip levels of this
// picture provide the blur: a fine level inside the photo, and coarser levels in its empty areas and outside it.

import { Camera, HalfFloatType, LinearFilter, LinearMipmapLinearFilter, Mesh, PlaneGeometry } from "three";
import { ShaderMaterial, UnsignedByteType, Vector2, WebGLRenderTarget } from "three";

/** @typedef {import("./photo.js").Photo} Photo */

/** Long side of the small picture in texels. */
const longSide = 256;

/** Number of cells along each side of the backdrop. */
const cells = 32;

// Fetches colors per vertex, because a software renderer would fetch them for every pixel, visible or not.
const vertexShader = `
    uniform sampler2D farthest;
    uniform vec2 size; // size of the picture in texels
    uniform vec3 emptyColor; // fallback where the picture is empty at all levels
    varying vec3 seenColor;

    vec3 blurred(vec2 place) {
        vec2 nearest = clamp(place, 0.0, 1.0);
        float level = log2(8.0 + distance(place * size, nearest * size));
        vec4 sum = vec4(0.0); // premultiplied
        for (int i = 0; i < 10 && sum.a < 0.99; ++i) sum += (1.0 - sum.a) * textureLod(farthest, nearest, level + float(i));
        return sum.a > 0.0 ? sum.rgb / sum.a : emptyColor;
    }

    void main() {
        // Small cells in and around the photo, larger cells outside, so far that no window or headset shows their end.
        vec2 place = 0.6 * position.xy + 25.0 * sign(position.xy) * pow(abs(position.xy), vec2(41.0));
        seenColor = blurred(0.5 + place); // the photo covers [0, 1]
        gl_Position = (projectionMatrix * modelViewMatrix * vec4(place, 0.0, 1.0)).xyww; // maximum depth, so that the model hides it
    }`;

const fragmentShader = `
    varying vec3 seenColor;
    void main() {
        gl_FragColor = vec4(seenColor, 1.0);
        #include <colorspace_fragment>
    }`;

/** One for all backdrops, because a renderer keeps what it has made for a geometry. */
const plane = new PlaneGeometry(2, 2, cells, cells);

export class Backdrop extends Mesh {
    /** @param {import("three").Color} emptyColor */
    constructor(emptyColor) {
        const uniforms = { farthest: { value: null }, size: { value: new Vector2() }, emptyColor: { value: emptyColor } };
        super(plane, new ShaderMaterial({ uniforms, vertexShader, fragmentShader, depthWrite: false }));
        this.frustumCulled = false;
        this.renderOrder = 3; // after opaque objects, so that only gaps are shaded; soft edges blend over it
        /** @type {WebGLRenderTarget | null} */
        this.picture = null;
    }

    /**
     * Draws the backdrop of this photo.
     *
     * @param {import("three").WebGLRenderer} renderer
     * @param {Photo} photo  with its model at the origin
     */
    show(renderer, { model, aspect, halfHeight, nearest, farthest }) {
        this.position.z = -farthest;
        this.scale.set(2 * farthest * halfHeight * aspect, 2 * farthest * halfHeight, 1);
        const [width, height] = aspect > 1 ? [longSide, longSide / aspect] : [longSide * aspect, longSide];
        this.release();
        this.picture = new WebGLRenderTarget(Math.ceil(width), Math.ceil(height), {
            type: renderer.extensions.has("EXT_color_buffer_float") ? HalfFloatType : UnsignedByteType,
            generateMipmaps: true,
            minFilter: LinearMipmapLinearFilter,
            magFilter: LinearFilter,
        });
        this.material.uniforms.farthest.value = this.picture.texture;
        this.material.uniforms.size.value.set(this.picture.width, this.picture.height);

        const hidden = [];
        model.traverse((part) => {
            if (!part.visible || ![part.material ?? []].flat().some((material) => material.transparent)) return;
            part.visible = false; // hides soft edges, which have the foreground's colors
            hidden.push(part);
        });
        const [target, clearAlpha] = [renderer.getRenderTarget(), renderer.getClearAlpha()];
        renderer.xr.enabled = false;
        renderer.setClearAlpha(0);
        renderer.setRenderTarget(this.picture);
        renderer.render(model, cameraThatSeesTheFarthest(halfHeight * aspect, halfHeight, 0.5 * nearest, 2 * farthest));
        renderer.setRenderTarget(target);
        renderer.setClearAlpha(clearAlpha);
        renderer.xr.enabled = true;
        for (const part of hidden) part.visible = true;
    }

    /** Frees the picture. */
    release() {
        this.picture?.dispose();
        this.picture = null;
    }
}

/** Returns the photo's camera with reversed depth order: the farthest surface hides the others. */
function cameraThatSeesTheFarthest(halfWidth, halfHeight, near, far) {
    const camera = new Camera();
    camera.projectionMatrix.makePerspective(-near * halfWidth, near * halfWidth, near * halfHeight, -near * halfHeight, near, far);
    for (const z of [2, 6, 10, 14]) camera.projectionMatrix.elements[z] *= -1;
    camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
    return camera;
}
