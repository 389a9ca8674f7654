import {render} from 'preact';
import {App} from './app';
import {live} from './model/live';
import 'uplot/dist/uPlot.min.css';
import './style.css';

live.start();
render(<App />, document.getElementById('app')!);
