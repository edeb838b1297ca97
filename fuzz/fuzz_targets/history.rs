//! `history.csv` and `run.json`: any bytes give a result or a typed error, soon and in little memory.

#![no_main]

use kanagata_fuzz::damage::Text;
use kanagata_fuzz::limits::SECONDS;
use kanagata_fuzz::readers::read_history;

kanagata_fuzz::target!(read_history, SECONDS, Text::Words, include_str!("../history.dict"));
