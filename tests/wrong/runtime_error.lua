-- expect: 3: undefined global "nothing"; did you mean "string"?
local rd = require "refdyn"
local mass = nothing.mass
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
}
