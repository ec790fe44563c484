// The Khronos validator's report on each file, as JSON.
import fs from 'node:fs';
import { createRequire } from 'node:module';
import path from 'node:path';

const [modules, ...files] = process.argv.slice(2);
const validator = createRequire(path.join(modules, 'x.js'))('gltf-validator');
const reports = [];
for (const file of files) {
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { maxIssues: 20 });
  reports.push(report.issues);
}
console.log(JSON.stringify(reports));
