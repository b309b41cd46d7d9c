-- expect: 3: model constinit: a reserved word of C or C++; choose another name
local rd = require "refdyn"
return rd.model {
  name = "constinit", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
  },
}
