-- expect: 3: string.format: argument 2 is of type table; must be a text, number or boolean
local rd = require "refdyn"
local s = string.format("%s", {})
