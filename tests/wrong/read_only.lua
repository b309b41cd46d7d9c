-- expect: 4: assignment to a field of the state or of the parameters: they are read only
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "kg" }, { "k", 10, "N/m" } }
p.m = 3
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
}
