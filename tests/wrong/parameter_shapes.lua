-- expect: 8: item 5 of a list is nil; lists must have no gaps
-- expect: 9: parameter m: a text; must be a number or an expression
-- expect: 10: parameters[2]: not a parameter; must be { "name", value, "unit" }
-- expect: 11: parameters[3]: not a parameter; must be { "name", value, "unit" }
-- expect: 12: parameters[4]: not a parameter; must be { "name", value, "unit" }
-- expect: 14: parameter e: value nan; must be finite
local rd = require "refdyn"
local p = rd.parameters {
  { "m", "1" },
  { "k" },
  { "c", 1, unit = "kg" },
  { "d", 1, 2 },
  nil,
  { "e", 0 / 0 },
}
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", mass = p.m },
    { "b", joint = "z", mass = p.k },
    { "c", joint = "z", mass = p.c },
    { "d", joint = "z", mass = p.d },
    { "e", joint = "z", mass = p.unit },
  },
}
