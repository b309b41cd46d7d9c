-- expect: 2: the file returns a table, return rd.model { ... } is needed
return { name = "wrong" }
