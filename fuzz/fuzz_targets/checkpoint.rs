//! Checkpoints: any body with its right digest gives a state that a run goes on from, or a typed error.

#![no_main]

use kanagata_fuzz::checkpoint::restore;
use kanagata_fuzz::damage::Text;
use kanagata_fuzz::limits::SECONDS;

kanagata_fuzz::target!(restore, SECONDS, Text::Checkpoint, include_str!("../checkpoint.dict"));
