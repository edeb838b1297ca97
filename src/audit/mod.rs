//! Shape error of a tool model against its CAD (Eq. 24).
