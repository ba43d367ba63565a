// Measures ONNX Runtime on the models that dense_convolution.py writes, on one thread:
//     node dense_convolution.mjs WIDTH HEIGHT CHANNELS...     prints per line: channels, median milliseconds of processor time
// Run in a folder with onnxruntime-node and the models.
import ort from 'onnxruntime-node';

const [width, height, ...allChannels] = process.argv.slice(2).map(Number);
for (const channels of allChannels) {
    const options = {intraOpNumThreads: 1, interOpNumThreads: 1, graphOptimizationLevel: 'all'};
    const session = await ort.InferenceSession.create(`conv_${channels}.onnx`, options);
    const values = Float32Array.from({length: channels * height * width}, (_, i) => (i % 2001) / 1000 - 1);
    const x = new ort.Tensor('float32', values, [1, channels, height, width]);
    const milliseconds = [];
    for (let i = 0; i < 4; ++i) {
        const start = process.cpuUsage();
        await session.run({x});
        const used = process.cpuUsage(start);
        milliseconds.push((used.user + used.system) / 1e3);
    }
    console.log(channels, milliseconds.slice(1).sort((a, b) => a - b)[1]);
}
process.exit(0);
