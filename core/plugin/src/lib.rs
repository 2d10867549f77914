//! What a plugin author writes against: the Robot and Sensor traits, messages and export macros.
