-- expect: 3: model RefDyn_x: names that begin with refdyn belong to the runtime; choose another name
local rd = require "refdyn"
return rd.model {
  name = "RefDyn_x", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
  },
}
