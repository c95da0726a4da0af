// Validates GLB files and prints their issues as JSON; exits non-zero when one has an error.
// usage: node gltf.cjs FILE..   (the package gltf-validator must be on NODE_PATH)
const fs = require("fs");
const validator = require("gltf-validator");

(async () => {
  let errors = 0;
  for (const file of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
    errors += report.issues.numErrors;
    const messages = report.issues.messages.filter((m) => m.severity === 0);
    console.log(JSON.stringify({ file, errors: report.issues.numErrors, messages }));
  }
  process.exit(errors === 0 ? 0 : 1);
})();
