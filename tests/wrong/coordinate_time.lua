-- expect: 7: coordinate t: this is the name of the time; choose another name
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "psi", mass = 1, center = { 0.5, 0, 0 } },
    { "fore", on = "arm", joint = "psi", coordinate = "t", mass = 1, center = { 0.5, 0, 0 } },
  },
}
