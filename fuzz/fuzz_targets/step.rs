//! STEP: any bytes give a result or a typed error, soon and in little memory.

#![no_main]

use kanagata_fuzz::damage::Text;
use kanagata_fuzz::limits::SECONDS;
use kanagata_fuzz::readers::read_step;

kanagata_fuzz::target!(read_step, SECONDS, Text::Words, include_str!("../step.dict"));
