-- expect: 3: model Con: a device of Windows, another name is needed
local rd = require "refdyn"
return rd.model {
  name = "Con", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
  },
}
