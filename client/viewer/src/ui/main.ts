import 'uplot/dist/uPlot.min.css';
import './page.css';
import { App } from './app';

new App();
