// Compares pictures. Chromium decodes and scales them on a separate page.

/** All pictures are PNG or JPEG files in base64. */
export class PictureDesk {
    /** @param {import("playwright-core").Page} page  an empty page */
    constructor(page) {
        this.page = page;
    }

    static async open(context) {
        const page = await context.newPage();
        await page.evaluate(() => {
            /** Returns the pixels of a picture, or of its center, scaled to width x height. */
            window.pixelsOf = async (base64, width, height, hidden = 0) => {
                const image = new Image();
                image.src = `data:image;base64,${base64}`;
                await image.decode();
                const [left, top] = [hidden * image.width, hidden * image.height];
                const canvas = new OffscreenCanvas(width || image.width, height || image.height);
                const context = canvas.getContext("2d");
                context.imageSmoothingQuality = "high";
                context.drawImage(image, left, top, image.width - 2 * left, image.height - 2 * top, 0, 0, canvas.width, canvas.height);
                return context.getImageData(0, 0, canvas.width, canvas.height);
            };
            window.brightness = ({ data }, i) => data[4 * i] + data[4 * i + 1] + data[4 * i + 2];
        });
        return new PictureDesk(page);
    }

    /**
     * Returns the peak signal-to-noise ratio in dB between a picture and another one, which is scaled to the picture's size.
     *
     * @param {number} hidden  share of the other's width to cut off at the left and at the right, and of its height at the top and bottom
     */
    psnr(picture, other, hidden = 0) {
        return this.page.evaluate(
            async ([picture, other, hidden]) => {
                const a = await pixelsOf(picture);
                const b = await pixelsOf(other, a.width, a.height, hidden);
                let sum = 0;
                for (let i = 0; i < a.data.length; ++i) if (i % 4 !== 3) sum += (a.data[i] - b.data[i]) ** 2;
                return 10 * Math.log10((255 * 255 * 0.75 * a.data.length) / sum);
            },
            [picture, other, hidden],
        );
    }

    /** Returns the mean of all color values, 0 to 255. */
    brightness(picture) {
        return this.page.evaluate(async (picture) => {
            const pixels = await pixelsOf(picture);
            let sum = 0;
            for (let i = 0; i < pixels.width * pixels.height; ++i) sum += brightness(pixels, i) / 3;
            return sum / (pixels.width * pixels.height);
        }, picture);
    }

    /**
     * Measures the left edge of a white shape, between a quarter and three quarters of the picture's height.
     *
     * @returns {Promise<{width: number, levels: number}>} mean number of pixels per row between shape and background, and number of
     *     different brightness values among them
     */
    leftEdge(picture) {
        return this.page.evaluate(async (picture) => {
            const pixels = await pixelsOf(picture);
            const { width, height } = pixels;
            const [top, bottom] = [height >> 2, (3 * height) >> 2];
            const levels = new Set();
            let count = 0;
            for (let y = top; y < bottom; ++y) {
                const behind = brightness(pixels, y * width);
                for (let x = 0; x < width >> 1; ++x) {
                    const value = brightness(pixels, y * width + x);
                    if (Math.abs(value - behind) <= 12 || value >= 3 * 255 - 12) continue;
                    count += 1;
                    levels.add(value);
                }
            }
            return { width: count / (bottom - top), levels: levels.size };
        }, picture);
    }

    /** Returns the share of pixels that have exactly this color. */
    shareOf(picture, color) {
        return this.page.evaluate(
            async ([picture, color]) => {
                const { data } = await pixelsOf(picture);
                let count = 0;
                for (let i = 0; i < data.length; i += 4) count += color.every((value, c) => data[i + c] === value);
                return count / (data.length / 4);
            },
            [picture, color],
        );
    }

    /**
     * Returns the motion of a near and a far detail between two pictures, in pixels to the right and down.
     *
     * @param {string} depth  the depth map, near is bright
     * @param {number} hidden  share of the depth map's width and height that the pictures don't show, at each border
     */
    parallax(before, after, depth, hidden) {
        return this.page.evaluate(
            async ([before, after, depth, hidden]) => {
                const a = await pixelsOf(before);
                const b = await pixelsOf(after);
                const map = await pixelsOf(depth, a.width, a.height, hidden);
                const { width, height } = a;
                const size = 24;
                const reach = 14;

                // Selects the blocks with most detail, among the nearest and among the farthest.
                const blocks = [];
                for (let y = reach; y + size + reach < height; y += size / 2)
                    for (let x = reach; x + size + reach < width; x += size / 2) {
                        const block = { x, y, low: 765, high: 0, detail: 0 };
                        for (let v = 0; v < size; ++v)
                            for (let u = 0; u < size; ++u) {
                                const i = (y + v) * width + x + u;
                                block.low = Math.min(block.low, brightness(map, i));
                                block.high = Math.max(block.high, brightness(map, i));
                                block.detail += Math.abs(brightness(a, i) - brightness(a, i + 1)) + Math.abs(brightness(a, i) - brightness(a, i + width));
                            }
                        if (block.high - block.low < 60) blocks.push(block); // on one surface
                    }
                blocks.sort((p, q) => p.low - q.low);
                const some = Math.ceil(blocks.length / 10);
                const mostDetailed = (candidates) => candidates.reduce((p, q) => (q.detail > p.detail ? q : p));

                const motionOf = ({ x, y }) => {
                    let best = { error: Infinity };
                    for (let down = -reach; down <= reach; ++down)
                        for (let right = -reach; right <= reach; ++right) {
                            let error = 0;
                            for (let v = 0; v < size; ++v)
                                for (let u = 0; u < size; ++u)
                                    error += Math.abs(brightness(a, (y + v) * width + x + u) - brightness(b, (y + v + down) * width + x + u + right));
                            if (error < best.error) best = { error, right, down };
                        }
                    return { right: best.right, down: best.down };
                };
                return { near: motionOf(mostDetailed(blocks.slice(-some))), far: motionOf(mostDetailed(blocks.slice(0, some))) };
            },
            [before, after, depth, hidden],
        );
    }

    /** Returns the left or the right half of a picture. */
    half(picture, side) {
        return this.page.evaluate(
            async ([picture, side]) => {
                const pixels = await pixelsOf(picture);
                const canvas = document.createElement("canvas");
                canvas.width = pixels.width >> 1;
                canvas.height = pixels.height;
                canvas.getContext("2d").putImageData(pixels, side === "left" ? 0 : -canvas.width, 0);
                return canvas.toDataURL("image/png").split(",")[1];
            },
            [picture, side],
        );
    }
}
