/** Files of the current picture. */
export { clip, type Clip } from './clip';
export { download } from './download';
export { geojson } from './geojson';
export { marksOf } from './marks';
export { png } from './png';
export { svg } from './svg';
