-- expect: 3: model constinit: a reserved word of C or C++, another name is needed
local rd = require "refdyn"
return rd.model {
  name = "constinit", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
  },
}
