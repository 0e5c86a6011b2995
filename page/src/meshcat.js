// What is used of meshcat's bundle: a script of its own, as the meshcat package has it, which
// index.html loads before.
export const { THREE, Viewer } = MeshCat;
