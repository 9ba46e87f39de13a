// Runs transforms of glTF-Transform on a file with virtual lights, once for each, as programs do:
//   node transform.mjs IN.glb FOLDER [--without-plugin]
// writes FOLDER/STEP.glb (or .gltf) and prints { "STEP": "" or why it was not written }.
import path from "node:path";
import { Document, Logger, NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import * as functions from "@gltf-transform/functions";
import { VLMVirtualLightMesh } from "gltf-transform-vlm";
import { MeshoptEncoder, MeshoptSimplifier } from "meshoptimizer";

const { dedup, flatten, instance, join, mergeDocuments, prune, quantize, reorder, resample, simplify, unpartition, weld } = functions;
await Promise.all([MeshoptEncoder.ready, MeshoptSimplifier.ready]);

/** A document that begins with a node of its own, and then has all of `document`: every number moves up. */
function after(document, fill = () => {}) {
  const merged = new Document().setLogger(document.getLogger());
  const node = merged.createNode("before");
  merged.createScene().addChild(node);
  fill(merged, node);
  mergeDocuments(merged, document);
  return merged;
}

/** A triangle to be drawn, which the lights do not know. */
function addTriangle(document, node) {
  const positions = document.createAccessor().setType("VEC3").setArray(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]));
  positions.setBuffer(document.createBuffer());
  node.setMesh(document.createMesh().addPrimitive(document.createPrimitive().setAttribute("POSITION", positions)));
}

const byTransform = (...transforms) => async (document) => document.transform(...transforms);
const encoder = MeshoptEncoder;
const simplifier = MeshoptSimplifier;

const STEPS = {
  // The scene stays as it is.
  "copy.glb": (document) => document,
  "copy.gltf": (document) => document,
  "clone.glb": (document) => functions.cloneDocument(document),
  "prune.glb": byTransform(prune()),
  "dedup.glb": byTransform(dedup()),
  "resample.glb": byTransform(resample(), prune(), dedup()),
  "node_before.glb": async (document) => after(document).transform(unpartition()),
  "lights_only.glb": byTransform((document) => {
    document.getRoot().listNodes().find((node) => node.getName() === "lamp").dispose();
  }),
  // It changes.
  "triangle_before.glb": async (document) => after(document, addTriangle).transform(unpartition()),
  "moved.glb": byTransform((document) => {
    document.getRoot().listNodes().find((node) => node.getMesh()).setTranslation([0, 0.25, 0]);
  }),
  "undrawn.glb": byTransform((document) => {
    document.getRoot().listNodes().find((node) => node.getMesh()).setMesh(null);
  }, prune()),
  "simplify.glb": byTransform(weld(), simplify({ simplifier, ratio: 0.25, error: 0.05 })),
  "quantize.glb": byTransform(quantize()),
  "join.glb": byTransform(flatten(), join(), prune()),
  "optimize.glb": byTransform(
    dedup(), instance(), flatten(), join(), weld(), simplify({ simplifier, ratio: 0.25, error: 0.05 }), resample(), prune(),
    reorder({ encoder }), quantize(),
  ),
  // It cannot be written.
  "twice.glb": async (document) => {
    mergeDocuments(document, functions.cloneDocument(document));
    return document.transform(unpartition());
  },
};

const [input, folder, without] = process.argv.slice(2);
const extensions = without ? ALL_EXTENSIONS : [...ALL_EXTENSIONS, VLMVirtualLightMesh];
const dependencies = { "meshopt.encoder": encoder };
const results = {};
for (const [name, step] of Object.entries(STEPS)) {
  const io = new NodeIO().setLogger(new Logger(Logger.Verbosity.ERROR));
  io.registerExtensions(extensions).registerDependencies(dependencies);
  try {
    await io.write(path.join(folder, name), await step(await io.read(input)));
    results[name] = "";
  } catch (error) {
    results[name] = error.message;
  }
}
console.log(JSON.stringify(results));
