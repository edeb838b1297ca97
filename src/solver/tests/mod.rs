//! Claims about contact, friction, Newton and stepping, on tools made by hand.

mod cup;
