-- expect: 7: parameter m: a text; must be a number or an expression
-- expect: 8: parameters[2]: not a parameter; must be { "name", value, "unit" }
-- expect: 9: parameters.k: a named entry; write { "k", value, "unit" }
-- expect: 10: parameters[3]: not a parameter; must be { "name", value, "unit" }
local rd = require "refdyn"
local p = rd.parameters {
  { "m", "kg" },
  { 1, "kg" },
  k = 3,
  { "c", 1, "kg", 4 },
}
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
}
