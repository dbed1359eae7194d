// Kinds of particle files that the page recognises but cannot read.

/** The beginning of a file: its bytes as Latin-1 text, and its extension in lower case. */
export interface FileHead { text: string; extension: string }

/** Formats that the page reads, for errors. */
export const READABLE = 'CSV, LAMMPS text dumps, NPY, NPZ, VTK (.vtk, .vtp, .vtu, .pvd, .series), extended XYZ and recordings (.pemc)';

const KINDS: readonly { name: string; matches(head: FileHead): boolean; remedy?: string }[] = [
  { name: 'an HDF5 file', matches: ({ text }) => text.startsWith('\x89HDF\r\n') },
  { name: 'a GSD file', matches: ({ text }) => text.startsWith('\xDF\x65\xDF\x65\xDF\x65\xDF\x65') },
  { name: 'a BGEO file', matches: ({ text, extension }) => text.startsWith('BgeoV') || /^(bgeo|bhclassic)$/.test(extension) },
  { name: 'a PLY file', matches: ({ text }) => /^ply\r?\n/.test(text) },
  {
    name: 'a Python pickle', remedy: 'Save plain arrays with numpy.savez, and open the NPZ file here.',
    matches: ({ text, extension }) => /^(pkl|pickle)$/.test(extension) || text.startsWith('\x80\x04\x95'),
  },
  {
    name: 'a LAMMPS data file', remedy: "Write a dump with the command 'dump', and open the dump here.",
    matches: ({ text }) => text.includes(' atoms\n') && text.includes(' xlo xhi'),
  },
  {
    name: 'a LAMMPS input script', remedy: 'Run it, and open the dump that it writes.',
    matches: ({ text }) => /(^|\n)(units|atom_style|pair_style|dimension|read_data) /.test(text),
  },
  {
    name: 'raw binary XYZ',
    remedy: "Convert it with NumPy: numpy.save('frame.npy', numpy.fromfile('frame.xyz', '<f4').reshape(-1, 3)).",
    matches: ({ text, extension }) => extension === 'xyz' && !/^\s*\d/.test(text),
  },
];

/** The reason why a file is refused, and a remedy, as sentences. */
export function refusalOf(name: string, head: FileHead): string {
  const kind = KINDS.find(({ matches }) => matches(head));
  if (!kind) return `${name} is of an unknown kind. The page reads ${READABLE}.`;
  const remedy = kind.remedy ?? `Run partiemc convert ${name} out.pemc, and open out.pemc here.`;
  return `${name} is ${kind.name}, which the page cannot read. ${remedy}`;
}
