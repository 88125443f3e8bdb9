// Builds the page from its sources into viz/smachpy_viz/web, which is in the repository: users build nothing.
//   node build.mjs [--check | --tests]   --check only compares; --tests bundles the tests for `node --test`
import { createHash } from "node:crypto";
import { mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const TARGET = "../smachpy_viz/web/";
const WRITTEN = ["__init__.py", "index.html"]; // by hand, in the same folder
const MADE = { bundle: true, write: false, target: "es2022", charset: "utf8", legalComments: "none" };

/** Packages of which something is shipped, with the files that are copied as they are. */
const PACKAGES = {
  elkjs: { "lib/elk-worker.min.js": "elk-worker.js" },
  preact: {},
  "@preact/signals": {},
  "@preact/signals-core": {},
  uplot: {},
  gifenc: {},
  mediabunny: {},
  "@fontsource-variable/inter": { "files/inter-latin-wght-normal.woff2": "inter.woff2" },
  "@fontsource-variable/jetbrains-mono": { "files/jetbrains-mono-latin-wght-normal.woff2": "jetbrains-mono.woff2" },
};

/** Bundle a source; returns its text. The result has one statement a line, so that branches merge it as they do sources. */
async function bundle(source, options = {}) {
  const { outputFiles, metafile } = await build({ ...MADE, entryPoints: [source], metafile: true, ...options });
  for (const path of Object.keys(metafile.inputs)) {
    const [, name] = path.match(/^node_modules\/((?:@[^/]+\/)?[^/]+)/) ?? [];
    if (name && !(name in PACKAGES)) throw new Error(`${path}: name its package in build.mjs, with its licence`);
  }
  return outputFiles[0].contents;
}

/** All files to ship, by name. */
async function files() {
  const made = {
    "page.js": await bundle("src/app.tsx", { format: "esm" }),
    "hub-worker.js": await bundle("src/core/hub_worker.ts", { format: "iife" }),
    "film-worker.js": await bundle("src/drawing/film_worker.ts", { format: "iife", minify: true }), // in each saved page
    "page.css": await bundle("styles/index.css", { external: ["*.woff2"] }),
  };
  const sources = [];
  const lock = JSON.parse(readFileSync("package-lock.json", "utf-8"));
  for (const [name, copied] of Object.entries(PACKAGES)) {
    const folder = `node_modules/${name}`;
    for (const [from, to] of Object.entries(copied)) made[to] = withoutMap(readFileSync(`${folder}/${from}`));
    const licence = readdirSync(folder).find((one) => /^licen[cs]e/i.test(one));
    made[`licences/${name.split("/").at(-1)}.LICENSE.txt`] = readFileSync(`${folder}/${licence}`);
    const { version, license } = JSON.parse(readFileSync(`${folder}/package.json`, "utf-8"));
    const archive = lock.packages[folder].integrity.replace(/^sha512-/, "");
    sources.push({
      name,
      version,
      licence: license,
      sha512: Buffer.from(archive, "base64").toString("hex"),
      files: Object.values(copied),
    });
  }
  const built = Object.fromEntries(Object.entries(made).map(([name, content]) => [name, sha256(content)]));
  const told = { sources: sourcesHash(), built, packages: sources };
  made["built.json"] = Buffer.from(`${JSON.stringify(told, null, 2)}\n`);
  return made;
}

/** A hash of all that the page is built from, which a test without Node.js compares. */
function sourcesHash() {
  const hash = createHash("sha256");
  const names = ["src", "styles"].flatMap((top) =>
    readdirSync(top, { recursive: true, withFileTypes: true })
      .filter((one) => one.isFile())
      .map((one) => `${one.parentPath}/${one.name}`),
  );
  for (const name of [...names, "build.mjs", "package-lock.json"].sort())
    hash.update(`${name}\n`).update(readFileSync(name));
  return hash.digest("hex");
}

const sha256 = (content) => createHash("sha256").update(content).digest("hex");

/** Source maps are not shipped. */
const withoutMap = (content) =>
  Buffer.from(content.toString("latin1").replace(/\n?\/\/# sourceMappingURL=\S*\s*$/, ""), "latin1");

const isSame = (a, b) => Buffer.compare(Buffer.from(a), Buffer.from(b)) === 0;

function read(name) {
  try {
    return readFileSync(TARGET + name);
  } catch {
    return Buffer.from([]);
  }
}

if (process.argv[2] === "--tests") {
  rmSync(".tests", { recursive: true, force: true });
  const tests = readdirSync("test").filter((name) => /\.test\.tsx?$/.test(name));
  await build({
    ...MADE,
    write: true,
    entryPoints: tests.map((name) => `test/${name}`),
    outdir: ".tests",
    format: "esm",
    platform: "node",
    sourcemap: "inline",
  });
} else {
  const wanted = await files();
  const there = readdirSync(TARGET, { recursive: true, withFileTypes: true })
    .filter((one) => one.isFile() && !one.parentPath.includes("__pycache__"))
    .map((one) => `${one.parentPath}/${one.name}`.replace(/\/+/g, "/").slice(TARGET.length))
    .filter((name) => !WRITTEN.includes(name));
  const stale = there.filter((name) => !(name in wanted));
  const changed = Object.keys(wanted).filter((name) => !isSame(wanted[name], read(name)));
  if (process.argv[2] === "--check") {
    if (stale.length || changed.length) {
      console.error(`viz/smachpy_viz/web: ${[...changed, ...stale].join(", ")}: not as the sources say. Try make web`);
      process.exitCode = 1;
    }
  } else {
    for (const name of stale) rmSync(TARGET + name);
    mkdirSync(`${TARGET}licences`, { recursive: true });
    for (const name of changed) writeFileSync(TARGET + name, wanted[name]);
  }
}
