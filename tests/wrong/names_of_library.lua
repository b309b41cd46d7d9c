-- expect: 3: model lgamma: lgamma_r is a function of the C library; choose another name
local rd = require "refdyn"
return rd.model {
  name = "lgamma", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
  },
}
