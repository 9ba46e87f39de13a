// VLM_virtual_light_mesh for glTF-Transform: reads the extension into a document and writes it back, whatever happens in between.

import { Extension } from "@gltf-transform/core";
import { ArrayReader, ArrayWriter, SECTIONS, isArray } from "./arrays.js";
import { NAME, NodeLights, PrimitiveTags, VirtualLightArray, VirtualLightMeshes } from "./properties.js";

export { NodeLights, PrimitiveTags, VirtualLightArray, VirtualLightMeshes };

/**
 * The extension `VLM_virtual_light_mesh`. Register it before reading:
 *
 * ```js
 * const io = new NodeIO().registerExtensions([...ALL_EXTENSIONS, VLMVirtualLightMesh]);
 * ```
 */
export class VLMVirtualLightMesh extends Extension {
  static EXTENSION_NAME = NAME;
  extensionName = NAME;

  /** @hidden */
  read(context) {
    const reader = new ArrayReader(this.document, context);
    try {
      this.#readRoot(context.jsonDoc.json.extensions?.[NAME], reader);
      this.#readPrimitives(context, reader);
    } catch (error) {
      // The rest of the file is good; `vlm check` refuses the result, as nodes still refer to the lights.
      this.document.getLogger().warn(
        `${NAME}: left out: ${error.message}: another tool altered the file. Bake it again with \`vlm bake\`.`,
      );
      this.listProperties().forEach((property) => property.dispose());
      reader.takeView(context.jsonDoc.json.extensions?.[NAME]?.data?.bufferView);
    }
    this.#readNodes(context);
    reader.release();
    return this;
  }

  /** Reads the root object. Its arrays leave a null behind, so that they come back in their places. */
  #readRoot(json, reader) {
    if (!json) throw new Error("the root object is missing");
    const { data, ...rest } = structuredClone(json);
    const meshes = new VirtualLightMeshes(this.document.getGraph());
    for (const section of SECTIONS) {
      for (const [key, place] of Object.entries(rest[section] ?? {})) {
        if (!isArray(place)) continue;
        meshes.setArray(`${section}/${key}`, reader.read(place, `${section}.${key}`));
        rest[section][key] = null;
      }
    }
    this.document.getRoot().setExtension(NAME, meshes.setJSON(rest));
  }

  #readPrimitives(context, reader) {
    const meshes = context.jsonDoc.json.meshes ?? [];
    meshes.forEach((mesh, i) =>
      mesh.primitives.forEach((primitive, k) => {
        const json = primitive.extensions?.[NAME];
        if (!json) return;
        const { triangleTags, ...rest } = json;
        const tags = new PrimitiveTags(this.document.getGraph()).setJSON(rest);
        if (triangleTags) {
          tags.setTriangleTags(reader.read(triangleTags, `triangleTags of mesh ${i}, primitive ${k},`));
        }
        context.meshes[i].listPrimitives()[k].setExtension(NAME, tags);
      }),
    );
  }

  #readNodes(context) {
    const nodes = context.jsonDoc.json.nodes ?? [];
    nodes.forEach((node, i) => {
      const json = node.extensions?.[NAME];
      if (!json) return;
      context.nodes[i].setExtension(NAME, new NodeLights(this.document.getGraph()).setJSON(json));
    });
  }

  /** @hidden */
  write(context) {
    const { json } = context.jsonDoc;
    const root = this.document.getRoot();
    const meshes = this.#meshes();
    const writer = new ArrayWriter(context);
    const written = meshes ? this.#rootJSON(meshes, writer) : null;
    for (const mesh of root.listMeshes()) {
      const defs = json.meshes[context.meshIndexMap.get(mesh)].primitives;
      mesh.listPrimitives().forEach((primitive, i) => {
        const tags = primitive.getExtension(NAME);
        const array = tags?.getTriangleTags();
        if (tags) extend(defs[i], { ...tags.getJSON(), ...(array && { triangleTags: writer.write(array) }) });
      });
    }
    for (const node of root.listNodes()) {
      const lights = node.getExtension(NAME);
      if (lights) extend(json.nodes[context.nodeIndexMap.get(node)], lights.getJSON());
    }
    if (written) extend(json, { ...written, data: writer.finish() });
    return this;
  }

  /** The root object of the document. After `mergeDocuments`, which copies it without attaching it, it is found here too. */
  #meshes() {
    const all = this.listProperties().filter((property) => property instanceof VirtualLightMeshes);
    if (all.length > 1) {
      throw new Error(
        `${NAME}: the document holds the lights of ${all.length} files, which cannot be merged: each knows its own scene alone. ` +
          "Take them out with `vlm strip`, merge, and bake the result with `vlm bake`.",
      );
    }
    return this.document.getRoot().getExtension(NAME) ?? all[0] ?? null;
  }

  #rootJSON(meshes, writer) {
    const json = meshes.getJSON();
    for (const name of meshes.listArrayNames()) {
      const [section, key] = name.split("/");
      json[section][key] = writer.write(meshes.getArray(name));
    }
    return json;
  }
}

/** Adds the extension's object to a node, a primitive or the root. */
function extend(def, json) {
  def.extensions = { ...def.extensions, [NAME]: json };
}
