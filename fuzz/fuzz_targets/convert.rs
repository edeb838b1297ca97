//! IGES and STEP, converted and audited: any bytes give a result or a typed error, soon and in little memory.

#![no_main]

use kanagata_fuzz::damage::Text;
use kanagata_fuzz::limits::SECONDS_CONVERTING;
use kanagata_fuzz::readers::convert_quickly;

kanagata_fuzz::target!(convert_quickly, SECONDS_CONVERTING, Text::Cad, include_str!("../step.dict"));
