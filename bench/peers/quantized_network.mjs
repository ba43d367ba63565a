// ONNX Runtime on the model that quantized_network.py writes, one thread: prints the median in milliseconds.
// Run in a folder with onnxruntime-node, network.onnx and photo.f32. With a FILE as argument, also writes the result there, float32.
import {readFileSync, writeFileSync} from 'node:fs';
import ort from 'onnxruntime-node';

const options = {intraOpNumThreads: 1, interOpNumThreads: 1, graphOptimizationLevel: 'all'};
const session = await ort.InferenceSession.create('network.onnx', options);
const photo = new Float32Array(readFileSync('photo.f32').buffer.slice(0));
const x = new ort.Tensor('float32', photo, [1, 3, 384, 288]);
const milliseconds = [];
let y;
for (let i = 0; i < 14; ++i) {
    const start = performance.now();
    ({y} = await session.run({x}));
    milliseconds.push(performance.now() - start);
}
if (process.argv[2]) writeFileSync(process.argv[2], new Uint8Array(y.data.buffer, y.data.byteOffset, y.data.byteLength));
console.log(milliseconds.slice(5).sort((a, b) => a - b)[4]);
process.exit(0);
