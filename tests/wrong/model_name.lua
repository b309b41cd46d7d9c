-- expect: 3: model "my arm": no identifier of C, a letter and then letters, digits and _ are needed
local rd = require "refdyn"
return rd.model { name = "my arm", links = { { "a", joint = { "x" }, mass = 1 } } }
