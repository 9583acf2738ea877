// SPDX-License-Identifier: MIT
// risorius.h in JavaScript: the C API compiled to WebAssembly. Struct offsets are for pointers of
// 4 bytes.

export const List = { RAW: 0, GUI: 1, JOINTS: 2, SHAPES: 3, MAPS: 4, MESHES: 5, LODS: 6 };
const NO_GEOMETRY = 0;
const ABI = 1;

export class FaceError extends Error {}

/** The system calls of the C++ library: only time, random numbers and exit. */
function system(memory) {
  const enosys = () => 52;
  const calls = {
    environ_sizes_get: (count, size) => {
      const view = new DataView(memory().buffer);
      view.setUint32(count, 0, true);
      view.setUint32(size, 0, true);
      return 0;
    },
    environ_get: () => 0,
    proc_exit: (code) => {
      throw new FaceError(code ? "The face asks for more memory than the browser gives." : "The end.");
    },
  };
  return new Proxy(calls, { get: (all, name) => all[name] ?? enosys });
}

export class Library {
  /** In: bytes of risorius.wasm. Throws FaceError if the browser lacks a needed feature. */
  static async load(bytes) {
    const library = new Library();
    let module;
    try {
      module = await WebAssembly.compile(bytes);
    } catch (error) {
      throw new FaceError(`This browser cannot run WebAssembly with SIMD: ${error.message}`);
    }
    const imports = {};
    for (const { module: name } of WebAssembly.Module.imports(module)) {
      imports[name] = system(() => library.c.memory);
    }
    library.c = (await WebAssembly.instantiate(module, imports)).exports;
    library.c._initialize?.();
    if (library.c.risorius_abi() !== ABI) throw new FaceError("The page and its library differ.");
    return library;
  }

  text(pointer) {
    const bytes = new Uint8Array(this.c.memory.buffer, pointer);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }
  numbers(Type, pointer, count) {
    return new Type(this.c.memory.buffer, pointer, count);
  }
  /** A copy, because views become invalid when the memory grows. */
  copy(Type, pointer, count) {
    return pointer === 0 ? new Type(0) : this.numbers(Type, pointer, count).slice();
  }
  reserve(size) {
    const pointer = this.c.malloc(size);
    if (pointer === 0 && size > 0) throw new FaceError("The browser gives no more memory.");
    return pointer;
  }
  /** Copies an array into permanent memory, aligned to 16 bytes. Out: its address. */
  place(array) {
    const at = (this.reserve(array.byteLength + 16) + 15) & ~15;
    this.numbers(Uint8Array, at, array.byteLength).set(new Uint8Array(array.buffer, array.byteOffset, array.byteLength));
    return at;
  }
  /** Reads a clip from the bytes of a .rzc file: {rate, start, names, curves: [Float32Array], times}. */
  clip(bytes) {
    return this.with(bytes.length, (data) => {
      this.numbers(Uint8Array, data, bytes.length).set(bytes);
      const at = this.c.page_clip(data, bytes.length);
      const [rate, start] = this.copy(Float64Array, at, 2);
      const [controls, frames, names, curves, times, error] = this.copy(Uint32Array, at + 16, 6);
      if (error !== 0) throw new FaceError(this.text(error));
      const found = [];
      for (let i = 0, place = names; i < controls; ++i) {
        const bytes = new Uint8Array(this.c.memory.buffer, place);
        const size = bytes.indexOf(0);
        found.push(new TextDecoder().decode(bytes.slice(0, size)));
        place += size + 1;
      }
      return {
        rate,
        names: found,
        curves: found.map((_, i) => this.copy(Float32Array, curves + 4 * i * frames, frames)),
        times: times === 0
          ? Float64Array.from({ length: frames }, (_, i) => start + i / rate)
          : this.copy(Float64Array, times, frames),
      };
    });
  }
  /** Calls body with memory that is freed afterwards. */
  with(size, body) {
    const pointer = this.reserve(size);
    try {
      return body(pointer);
    } finally {
      this.c.free(pointer);
    }
  }
  lastError() {
    const at = this.c.risorius_last_error();
    const view = new DataView(this.c.memory.buffer, at);
    const offset = view.getBigInt64(16, true);
    const [field, message] = [this.text(view.getUint32(12, true)), this.text(view.getUint32(24, true))];
    return `${message}${field ? ` (${field}${offset >= 0n ? `, byte ${offset}` : ""})` : ""}`;
  }
  check(status) {
    if (status !== 0) throw new FaceError(this.lastError());
  }

  /** In: bytes of a DNA file. */
  open(bytes) {
    return this.with(bytes.length, (data) => {
      this.numbers(Uint8Array, data, bytes.length).set(bytes);
      return this.with(24, (options) => {
        const words = this.numbers(Uint32Array, options, 6);
        words.fill(0);
        words[0] = NO_GEOMETRY;
        const face = options + 20;
        this.check(this.c.risorius_open_memory(data, bytes.length, options, face));
        return new Face(this, this.numbers(Uint32Array, face, 1)[0]);
      });
    });
  }
}

class Face {
  constructor(library, pointer) {
    this.library = library;
    this.pointer = pointer;
  }
  count(list) {
    return this.library.c.risorius_count(this.pointer, list);
  }
  names(list) {
    const name = (_, i) => this.library.text(this.library.c.risorius_name(this.pointer, list, i));
    return Array.from({ length: this.count(list) }, name);
  }
  /** Indices in the list of a LOD. */
  itemsOf(list, lod) {
    const { library } = this;
    return library.with(8, (out) => {
      library.check(library.c.risorius_lod_items(this.pointer, list, lod, out, out + 4));
      const [items, count] = library.numbers(Uint32Array, out, 2);
      return library.copy(Uint16Array, items, count);
    });
  }
  skeleton() {
    const { library } = this;
    return library.with(52, (out) => {
      library.check(library.c.risorius_get_skeleton(this.pointer, out));
      const words = library.copy(Uint32Array, out, 13);
      const [count, stride] = words;
      return {
        count,
        stride,
        parents: library.copy(Uint16Array, words[2], count),
        neutral: library.copy(Float32Array, words[3], count * stride),
        inMetres: words[4] === 1,
        inRadians: words[5] === 1,
        axes: words.slice(6, 9),
        order: words[9],
        signs: new Int32Array(words.slice(10, 13).buffer),
      };
    });
  }
  instance() {
    const { library } = this;
    return library.with(4, (out) => {
      library.check(library.c.risorius_create(this.pointer, 0, out));
      return new Instance(library, library.numbers(Uint32Array, out, 1)[0]);
    });
  }
}

class Instance {
  constructor(library, pointer) {
    this.library = library;
    this.pointer = pointer;
    this.room = library.reserve(4);
  }
  /** In: values of the raw controls, starting with the first. */
  setRaw(values) {
    const { library } = this;
    library.with(4 * values.length, (at) => {
      library.numbers(Float32Array, at, values.length).set(values);
      library.check(library.c.risorius_set(this.pointer, List.RAW, 0, values.length, at));
    });
  }
  setLod(lod) {
    this.library.check(this.library.c.risorius_set_lod(this.pointer, lod));
  }
  evaluate() {
    this.library.check(this.library.c.risorius_evaluate(this.pointer));
  }
  /** A view, valid until the next call. */
  values(list) {
    const at = this.library.c.risorius_values(this.pointer, list, this.room);
    if (at === 0) throw new FaceError(this.library.lastError());
    return this.library.numbers(Float32Array, at, this.library.numbers(Uint32Array, this.room, 1)[0]);
  }
}
