-- expect: 0: --set speeed: unknown option, parameter or input; did you mean "speed"?
-- set: speeed=3
local rd = require "refdyn"
local p = rd.parameters { { "speed", 1, "m/s" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
}
