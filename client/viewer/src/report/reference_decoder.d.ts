declare module '*/meshopt_decoder_reference.js' {
  export const MeshoptDecoder: import('../protocol/surface').Codec;
}
