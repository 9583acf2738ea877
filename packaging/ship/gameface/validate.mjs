// SPDX-License-Identifier: MIT
// validate.mjs FILES: Khronos' validator on each; exit code 1 for an error or a warning that is not expected.
import fs from 'node:fs';
import validator from 'gltf-validator';

// The normal map comes without tangents, which every client makes from the texture coordinates. VRM 0.x
// is called VRM, which no other extension would be. TalkingHead wants meshes below the armature.
const EXPECTED = new Set(['MESH_PRIMITIVE_GENERATED_TANGENT_SPACE', 'INVALID_EXTENSION_NAME_FORMAT',
  'NODE_SKINNED_MESH_NON_ROOT']);
let bad = false;
for (const file of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { maxIssues: 1000 });
  const { numErrors, numWarnings, numInfos, messages } = report.issues;
  console.log(`${file.split('/').pop()}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos: ` +
    [...new Set(messages.map((m) => m.code))].join(', '));
  for (const { severity, code, message, pointer } of messages) {
    if (severity > 1 || EXPECTED.has(code)) continue;
    console.log(`  ${code} at ${pointer}: ${message}`);
    bad = true;
  }
}
process.exit(bad ? 1 : 0);
