-- expect: 6: --set n: value "two"; must be a whole number
-- expect: 7: --set m: value "heavy"; must be a number
-- set: n=two
-- set: m=heavy
local rd = require "refdyn"
local n = rd.option("n", 2)
local p = rd.parameters { { "m", 1, "kg" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
}
