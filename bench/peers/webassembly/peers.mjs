// Times the depth network of a peer in WebAssembly under node, one thread: node peers.mjs PEER MODELS LAYERS RUNS
//
//   onnx_runtime_web   the int8 network that ../shared/peers/build_models.py wrote to MODELS/qlinear_u8s8.onnx
//   tensorflow_js      the layers that LAYERS (../shared/tiefenrausch/layers.txt) lists, in float, with weights of the right shapes
//                      and ReLU as the only clipping, which is less work than the network's own
//
// Prints the median of RUNS runs in milliseconds. Loads the packages from the working directory.
import fs from 'fs';
import { createRequire } from 'module';

const [peer, models, layers, runs] = process.argv.slice(2);
const require = createRequire(process.cwd() + '/');

async function onnxRuntimeWeb() {
    const ort = require('onnxruntime-web');
    ort.env.wasm.numThreads = 1;
    const session = await ort.InferenceSession.create(fs.readFileSync(`${models}/qlinear_u8s8.onnx`),
                                                      { executionProviders: ['wasm'], graphOptimizationLevel: 'all' });
    const pixels = new Float32Array(fs.readFileSync(`${models}/columns.f32`).buffer.slice(0));
    const feeds = { x: new ort.Tensor('float32', pixels, [1, 3, 384, 288]) };
    return () => session.run(feeds);
}

/// Returns [{ kind, inputs, output, ... }] in order.
function readLayers() {
    const found = [];
    for (const line of fs.readFileSync(layers, 'utf8').split('\n')) {
        const shapes = [...line.matchAll(/\((\d+), (\d+), (\d+)\)/g)].map(m => m.slice(1).map(Number));
        const quoted = [...line.matchAll(/'(\d+_int8)'/g)].map(m => m[1]);
        const convolution = line.match(/(\S+) -> +(\S+) (conv3|dw3|pw1)s(\d)/);
        if (convolution) {
            const [, input, output, kind, stride] = convolution;
            found.push({ kind, inputs: [input], output, stride: Number(stride), from: shapes[0][2], to: shapes[1][2],
                         activation: / zp=0 /.test(line) ? 'relu' : 'linear' });
        } else if (/^ *add /.test(line)) {
            found.push({ kind: 'add', inputs: quoted.slice(0, 2), output: quoted[2] });
        } else if (/^ *up /.test(line)) {
            found.push({ kind: 'up', inputs: [quoted[0]], output: quoted[1], size: [2 * shapes[0][0], 2 * shapes[0][1]] });
        }
    }
    return found;
}

async function tensorflowJs() {
    const tf = require('@tensorflow/tfjs');
    const wasm = require('@tensorflow/tfjs-backend-wasm');
    wasm.setWasmPaths(process.cwd() + '/node_modules/@tensorflow/tfjs-backend-wasm/dist/');
    wasm.setThreadsCount(1);
    await tf.setBackend('wasm');
    await tf.ready();
    if (tf.getBackend() !== 'wasm') throw new Error('there is no wasm backend');
    const steps = readLayers(), readers = {};
    for (const s of steps) {
        for (const i of s.inputs) readers[i] = (readers[i] ?? 0) + 1;
        const size = s.kind === 'pw1' ? 1 : 3;
        if (s.kind === 'dw3') s.filter = tf.randomNormal([3, 3, s.to, 1], 0, 0.3);
        else if (s.to) s.filter = tf.randomNormal([size, size, s.from, s.to], 0, Math.sqrt(2 / (size * size * s.from)));
        if (s.to) s.bias = tf.zeros([s.to]);
    }
    const compute = {
        add: (s, x, y) => tf.add(x, y),
        up: (s, x) => tf.image.resizeNearestNeighbor(x, s.size),
        dw3: (s, x) => tf.fused.depthwiseConv2d({ x, ...s, strides: s.stride, pad: 'same' }),
    };
    const convolve = (s, x) => tf.fused.conv2d({ x, ...s, strides: s.stride, pad: 'same' });
    const pixels = tf.randomUniform([1, 288, 384, 3]);
    return () => tf.tidy(() => {
        const alive = { [steps[0].inputs[0]]: tf.clone(pixels) }, left = { ...readers };
        for (const s of steps) {
            alive[s.output] = (compute[s.kind] ?? convolve)(s, ...s.inputs.map(i => alive[i]));
            for (const i of s.inputs) if (--left[i] === 0) alive[i].dispose();
        }
        return alive[steps.at(-1).output].dataSync();
    });
}

const run = await { onnx_runtime_web: onnxRuntimeWeb, tensorflow_js: tensorflowJs }[peer]();
const times = [];
for (let i = -2; i < Number(runs); ++i) {
    const start = performance.now();
    await run();
    if (i >= 0) times.push(performance.now() - start);
}
times.sort((a, b) => a - b);
console.log(`median ${times[times.length >> 1].toFixed(2)}`);
process.exit(0);
