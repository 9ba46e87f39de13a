// Arrays of the extension between a file and the properties of a document.

import { BufferUtils, Format, GLB_BUFFER } from "@gltf-transform/core";
import { NAME, VirtualLightArray } from "./properties.js";

/** Objects of the root object that hold arrays. */
export const SECTIONS = ["lights", "samples", "grid"];

/** @param {unknown} value @returns {boolean} True for an array of the extension. */
export function isArray(value) {
  return Number.isInteger(value?.accessor);
}

/** Takes arrays out of a file that is being read. */
export class ArrayReader {
  /** @param {import("@gltf-transform/core").Document} document @param {import("@gltf-transform/core").ReaderContext} context */
  constructor(document, context) {
    this.document = document;
    this.context = context;
    this.taken = new Set();
  }

  /**
   * @param {{ accessor: number }} place @param {string} name For messages.
   * @returns {VirtualLightArray}
   * @throws If the file has no such accessor.
   */
  read(place, name) {
    const { accessor: index, ...rest } = place;
    const accessor = this.context.accessors[index];
    const values = accessor?.getArray();
    if (!values) throw new Error(`${name} names accessor ${index}, which the file lacks or has no data for`);
    this.taken.add(accessor);
    const def = { type: accessor.getType(), componentType: accessor.getComponentType(), count: accessor.getCount() };
    return new VirtualLightArray(this.document.getGraph()).setContent(def, rest, BufferUtils.toView(values).slice());
  }

  /** Counts what lies in the buffer view of the arrays as read, so that nothing of a damaged extension stays behind. */
  takeView(view) {
    const { accessors = [], bufferViews = [] } = this.context.jsonDoc.json;
    // Where another tool renumbered, the view is someone else's by now.
    if (bufferViews[view]?.name !== NAME) return;
    accessors.forEach((def, i) => def.bufferView === view && this.taken.add(this.context.accessors[i]));
  }

  /** Removes the accessors that were read, and a buffer that was there for them alone, from the document: writing makes new ones. */
  release() {
    const isRoot = (property) => property.propertyType === "Root";
    const buffers = new Set();
    for (const accessor of this.taken) {
      if (!accessor.listParents().every(isRoot)) continue;
      if (accessor.getBuffer()) buffers.add(accessor.getBuffer());
      accessor.dispose();
    }
    for (const buffer of buffers) {
      const others = this.document.getRoot().listBuffers().length > 1;
      if (others && buffer.listParents().every(isRoot)) buffer.dispose();
    }
  }
}

/** Appends arrays to a file that is being written, as the specification asks: at the end of every list, in a buffer view of their own. */
export class ArrayWriter {
  /** @param {import("@gltf-transform/core").WriterContext} context */
  constructor(context) {
    this.context = context;
    this.json = context.jsonDoc.json;
    this.view = this.json.bufferViews.length;
    this.parts = [];
    this.byteLength = 0;
  }

  /** @param {VirtualLightArray} array @returns {object} The array's object, with the number of its new accessor. */
  write(array) {
    const accessor = this.json.accessors.length;
    this.json.accessors.push({ bufferView: this.view, byteOffset: this.byteLength, ...array.getAccessor() });
    const bytes = BufferUtils.pad(array.getBytes());
    this.parts.push(bytes);
    this.byteLength += bytes.byteLength;
    return { accessor, ...array.getPlace() };
  }

  /** Writes the data. @returns {{ bufferView: number, bufferByteLength: number }} The root object's `data`. */
  finish() {
    const bytes = BufferUtils.concat(this.parts);
    const isGlb = this.context.options.format === Format.GLB;
    const place = isGlb ? this.#appendToBin(bytes) : this.#addBuffer(bytes);
    const { buffer, byteOffset, before } = place;
    this.json.bufferViews.push({ buffer, byteOffset, byteLength: this.byteLength, name: NAME });
    return { bufferView: this.view, bufferByteLength: before };
  }

  #appendToBin(bytes) {
    const { resources } = this.context.jsonDoc;
    const bin = resources[GLB_BUFFER] ?? new Uint8Array(0);
    const padded = BufferUtils.pad(bin);
    const before = this.json.buffers[0]?.byteLength ?? 0;
    const byteLength = padded.byteLength + bytes.byteLength;
    resources[GLB_BUFFER] = BufferUtils.concat([padded, bytes]);
    this.json.buffers[0] = { ...this.json.buffers[0], byteLength };
    return { buffer: 0, byteOffset: padded.byteLength, before };
  }

  #addBuffer(bytes) {
    const { resources } = this.context.jsonDoc;
    const stem = this.context.options.basename || "buffer";
    let uri = `${stem}.vlm.bin`;
    for (let i = 1; uri in resources; i++) uri = `${stem}_${i}.vlm.bin`;
    resources[uri] = bytes;
    // A buffer that held nothing but our arrays was written without content.
    const empty = this.json.buffers.findIndex((buffer) => !buffer.byteLength);
    const buffer = empty >= 0 ? empty : this.json.buffers.length;
    this.json.buffers[buffer] = { byteLength: bytes.byteLength, uri };
    return { buffer, byteOffset: 0, before: 0 };
  }
}
