-- expect: 3: string.format: argument 2 is of type table, texts, numbers and booleans are shown
local rd = require "refdyn"
local s = string.format("%s", {})
