// Registers the extension with the command line of glTF-Transform: gltf-transform COMMAND IN OUT --config THIS_FILE
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import { VLMVirtualLightMesh } from "gltf-transform-vlm";

export default { extensions: [...ALL_EXTENSIONS, VLMVirtualLightMesh] };
