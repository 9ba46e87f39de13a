// The extension's objects as properties of a glTF-Transform document.

import { ExtensionProperty, PropertyType, RefMap } from "@gltf-transform/core";

/** Name of the extension. */
export const NAME = "VLM_virtual_light_mesh";

/**
 * One array of the extension, such as the positions of the lights. It owns its bytes and is no Accessor, so that no transform can merge,
 * quantise, compress or prune it: its digest has to stay true.
 */
export class VirtualLightArray extends ExtensionProperty {
  static EXTENSION_NAME = NAME;

  init() {
    this.extensionName = NAME;
    this.propertyType = "VirtualLightArray";
    this.parentTypes = ["VirtualLightMeshes", "PrimitiveTags"];
  }

  getDefaults() {
    return Object.assign(super.getDefaults(), { accessor: {}, place: {}, bytes: new Uint8Array(0) });
  }

  /** @returns {{ type: string, componentType: number, count: number }} As in the accessor of the file. */
  getAccessor() {
    return this.get("accessor");
  }

  /** @returns {object} The array's object in the extension without its accessor: `digest`, and `compression` if there is one. */
  getPlace() {
    return this.get("place");
  }

  /** @returns {Uint8Array} The bytes as stored: little-endian elements, or the encoded stream if there is a `compression`. */
  getBytes() {
    return this.get("bytes");
  }

  /**
   * @param {object} accessor @param {object} place @param {Uint8Array} bytes
   * @returns {this}
   */
  setContent(accessor, place, bytes) {
    return this.set("accessor", accessor).set("place", place).set("bytes", bytes);
  }
}

/** The root object: what all Virtual Light Meshes of the file share. */
export class VirtualLightMeshes extends ExtensionProperty {
  static EXTENSION_NAME = NAME;

  init() {
    this.extensionName = NAME;
    this.propertyType = "VirtualLightMeshes";
    this.parentTypes = [PropertyType.ROOT];
  }

  getDefaults() {
    return Object.assign(super.getDefaults(), { json: "{}", arrays: new RefMap() });
  }

  /** @returns {object} A copy of the root object, without its arrays and `data`. */
  getJSON() {
    return JSON.parse(this.get("json"));
  }

  /** @param {object} json @returns {this} */
  setJSON(json) {
    return this.set("json", JSON.stringify(json));
  }

  /** @returns {string[]} Names of the arrays, such as `lights/positions`, in the order of the file. */
  listArrayNames() {
    return this.listRefMapKeys("arrays");
  }

  /** @param {string} name Such as `lights/positions`. @returns {VirtualLightArray | null} */
  getArray(name) {
    return this.getRefMap("arrays", name);
  }

  /** @param {string} name @param {VirtualLightArray | null} array @returns {this} */
  setArray(name, array) {
    return this.setRefMap("arrays", name, array);
  }
}

/** What a node says: which lights it bears, and the tag of what it draws. */
export class NodeLights extends ExtensionProperty {
  static EXTENSION_NAME = NAME;

  init() {
    this.extensionName = NAME;
    this.propertyType = "NodeLights";
    this.parentTypes = [PropertyType.NODE];
  }

  getDefaults() {
    return Object.assign(super.getDefaults(), { json: "{}" });
  }

  /** @returns {{ vlms?: string[], tag?: number }} A copy. */
  getJSON() {
    return JSON.parse(this.get("json"));
  }

  /** @param {{ vlms?: string[], tag?: number }} json @returns {this} */
  setJSON(json) {
    return this.set("json", JSON.stringify(json));
  }
}

/** The tag of a primitive, or those of its triangles. */
export class PrimitiveTags extends ExtensionProperty {
  static EXTENSION_NAME = NAME;

  init() {
    this.extensionName = NAME;
    this.propertyType = "PrimitiveTags";
    this.parentTypes = [PropertyType.PRIMITIVE];
  }

  getDefaults() {
    return Object.assign(super.getDefaults(), { json: "{}", triangleTags: null });
  }

  /** @returns {{ tag?: number }} A copy, without `triangleTags`. */
  getJSON() {
    return JSON.parse(this.get("json"));
  }

  /** @param {{ tag?: number }} json @returns {this} */
  setJSON(json) {
    return this.set("json", JSON.stringify(json));
  }

  /** @returns {VirtualLightArray | null} One number per triangle, in the order in which the primitive draws them. */
  getTriangleTags() {
    return this.getRef("triangleTags");
  }

  /** @param {VirtualLightArray | null} array @returns {this} */
  setTriangleTags(array) {
    return this.setRef("triangleTags", array);
  }
}
