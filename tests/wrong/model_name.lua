-- expect: 3: model "my arm": not an identifier of C; use a letter, then letters, digits and _
local rd = require "refdyn"
return rd.model { name = "my arm", links = { { "a", joint = { "x" }, mass = 1 } } }
